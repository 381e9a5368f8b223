"""Objects that the workspace has forgotten by time alone, kept in long-term memory. Pure.

What was broadcast as missing is unlearned: its base level falls by more than decay, and it is none
of them once it is forgotten, unless its base level has risen since: it was conscious as present, or
placed anew and confirmed.
"""

from __future__ import annotations

from collections.abc import Iterable

import msgspec
import numpy as np

from cogmap.geometry.se2 import transform_from
from cogmap.graph import decay
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import is_among, is_same
from cogmap.schemas.graph import Delta, DropNode, Phase
from cogmap.schemas.memory import StoredObjects
from cogmap.schemas.nodes import (
    NEVER_NS,
    RECOLLECTION_ID,
    ROOT_MAP,
    Map,
    Object,
    RecalledColumn,
    Recollection,
    object_id,
)
from cogmap.services.memory.config import MIN_SIGHTINGS
from cogmap.services.memory.episodic.corrections import Corrections, Shift

# Base levels that differ by less are equal but for rounding.
ROUNDING = 1e-9
LEARNED_BASE_LEVEL = 0.3
"""Base level from which on an object that the workspace forgets by time alone was learned. The
second view gives 0.15, and two broadcasts the rest; with less, what is placed badly would come back
too.
"""


class ForgottenObjects:
    """The learned objects of the root map that are not in `graph` any more, as they were when they
    were last seen or conscious. Their labels are none of those that are stored of the graph.
    """

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._present: dict[str, Object] = {}
        self._learned: set[str] = set()
        self._missing: set[str] = set()
        self._forgotten: dict[str, Object] = {}

        self._corrections = Corrections()
        self._recollection: Recollection | None = None
        self._frame = ""

    @property
    def known(self) -> list[Object]:
        """Return all of them, sorted by label."""
        return [self._forgotten[label] for label in sorted(self._forgotten)]

    def note(self, delta: Delta) -> None:
        """Note which objects a delta writes and drops, and follow the root map where it is
        corrected and joined to another. At the end of a cycle the workspace drops what has decayed.
        """
        for operation in delta.operations:
            if isinstance(operation, Object):
                self._write(operation)
            elif isinstance(operation, DropNode):
                self._drop(operation.id, has_decayed=delta.phase is Phase.END)
            elif isinstance(operation, Recollection):
                self._recollection = operation
            elif isinstance(operation, Map) and operation.id == ROOT_MAP:
                self._enter(operation.remembered)

        self._corrections.note(delta.operations)
        for rows in self._corrections.take():
            if self._forgotten:
                places_m = [(node.x_m, node.y_m) for node in self._forgotten.values()]
                self._move(Shift(rows)(places_m))

    def note_all(self, stored: StoredObjects | None) -> None:
        """Take up a graph that was loaded as a whole: what is missing in it, of what was present
        before, or in the record `stored` after a restart, was forgotten.
        """
        before = self._present
        if not before and stored is not None:
            before = {node.id: node for node in _objects_of(stored)}
            self._learned.update(before)

        self._corrections.note_all(self._graph)
        self._recollection = self._graph.get(Recollection, RECOLLECTION_ID) or self._recollection
        root = self._graph.get(Map, ROOT_MAP)
        self._enter("" if root is None else root.remembered)

        self._present = {}
        objects = list(self._graph.of_kind(Object))
        for node in objects:
            self._write(node)

        for name, node in before.items():
            if name not in self._present and not is_among(node, objects):
                self._present[name] = node
                self._drop(name, has_decayed=True)

    def _write(self, node: Object) -> None:
        before = self._present.pop(node.id, None)
        if node.map != ROOT_MAP:
            return

        self._present[node.id] = node
        if node.base_level >= LEARNED_BASE_LEVEL:
            self._learned.add(node.id)
        if before is not None:
            # Unlearned as missing, or conscious as present since.
            level = decay.base_level(before, node.cycle, self._graph.decay)
            if node.base_level < level - ROUNDING:
                self._missing.add(node.id)
            elif node.base_level > level + ROUNDING:
                self._missing.discard(node.id)
        if not self._is_stored(node):
            return

        # None is kept that came back or was learned anew as this, and no other by its label.
        for label, kept in list(self._forgotten.items()):
            if is_same(kept, node):
                del self._forgotten[label]

        self._forgotten.pop(node.label, None)

    def _drop(self, name: str, has_decayed: bool) -> None:
        node = self._present.pop(name, None)
        is_kept = has_decayed and name in self._learned - self._missing
        self._learned.discard(name)
        self._missing.discard(name)
        if node is None or not is_kept or not self._is_stored(node):
            return

        others = filter(self._is_stored, self._present.values())
        if not is_among(node, others):
            self._put(node)

    def _is_stored(self, node: Object) -> bool:
        """Decide whether an object of the graph was seen often enough to be stored."""
        return node.sightings >= MIN_SIGHTINGS

    def _put(self, node: Object) -> None:
        """Keep an object, as well known as one that was learned."""
        level = max(node.base_level, LEARNED_BASE_LEVEL)
        self._forgotten[node.label] = msgspec.structs.replace(node, base_level=level)

    def _enter(self, frame: str) -> None:
        """Follow the root map into the frame of the recalled map of that name, which was joined to
        it. If it is not known how that lies, nothing can be kept.
        """
        if frame == self._frame:
            return

        self._frame = frame
        recalled = self._recollection
        if recalled is None or recalled.map != frame:
            self._forgotten.clear()
        elif self._forgotten:
            pose = np.array([recalled.x_m, recalled.y_m, recalled.heading_rad])
            here_m = np.array([(node.x_m, node.y_m) for node in self._forgotten.values()])
            self._move(transform_from(pose, here_m).tolist())

    def _move(self, places_m: Iterable[Iterable[float]]) -> None:
        moved = zip(list(self._forgotten), places_m, strict=True)
        for label, (x_m, y_m) in moved:
            node = self._forgotten[label]
            self._forgotten[label] = msgspec.structs.replace(node, x_m=x_m, y_m=y_m)


def _objects_of(stored: StoredObjects) -> list[Object]:
    """Return the objects of a record. How well each was known is not stored."""
    objects = []
    rows = np.asarray(stored.objects.numpy(), np.float64).tolist()
    known = zip(
        stored.labels, stored.names, stored.given_names, stored.functions, rows, strict=True
    )
    for label, name, given_name, function, row in known:
        node = Object(
            id=object_id(label),
            label=label,
            names={name: max(1.0, row[RecalledColumn.SIGHTINGS])},
            given_name=given_name,
            function=function,
            x_m=row[RecalledColumn.X_M],
            y_m=row[RecalledColumn.Y_M],
            x_sd_m=row[RecalledColumn.X_SD_M],
            y_sd_m=row[RecalledColumn.Y_SD_M],
            width_m=row[RecalledColumn.WIDTH_M],
            height_m=row[RecalledColumn.HEIGHT_M],
            sightings=int(row[RecalledColumn.SIGHTINGS]),
            last_seen_ns=NEVER_NS,
        )
        objects.append(node)

    return objects
