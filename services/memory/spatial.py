"""Spatial Memory: it learns the root map when that is conscious, and recalls maps that it learned
before (beyond the paper, which leaves long-term memory open).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cogmap.graph.graph import Graph
from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.graph import Delta
from cogmap.schemas.memory import Stored, StoredObjects, StoredRecord, StoredTile
from cogmap.schemas.nodes import RECOLLECTION_ID, ROOT_MAP, Map, Object, Recollection
from cogmap.services.memory.associations import Associations
from cogmap.services.memory.config import MIN_SIGHTINGS, Config
from cogmap.services.memory.maps import RememberedMap, RememberedMaps
from cogmap.services.memory.objects.cueing import ObjectCues
from cogmap.services.memory.objects.forgotten import ForgottenObjects
from cogmap.services.memory.recall import cues, recalled
from cogmap.services.memory.recollection import recollection
from cogmap.services.memory.sequence_cue import way_of
from cogmap.services.memory.storing import ChangedPlaces, Changes, stored_objects, stored_tree


class SpatialMemory:
    """The maps that were learned, and the name under which the root map of `graph` is.

    Once a recalled map is joined to the root map, the two are one, and stored as the recalled one.
    """

    def __init__(self, config: Config, graph: Graph) -> None:
        self._config = config
        self._graph = graph
        self._maps = RememberedMaps()
        self._name = ""
        self._changed = ChangedPlaces()
        self._forgotten = ForgottenObjects(graph)
        self._cues = ObjectCues(config, graph)
        self._objects: list[StoredRecord] = []
        self._tree: list[StoredRecord] = []
        self._cued: set[str] = set()
        self._associations: Associations | None = None

    @property
    def name(self) -> str:
        """Return the name under which the root map was stored; empty before it is."""
        return self._name

    def restore(self, records: Iterable[StoredRecord]) -> None:
        """Take up the maps that the database holds."""
        self._maps.put(records)
        self._cued = set()
        self._associations = None

    def resume(self, past: Iterable[Stored]) -> None:
        """Continue to learn the map that was stored in this run."""
        for stored in past:
            self._maps.put(stored.records)
            for record in stored.records:
                if isinstance(record, StoredObjects | StoredTile):
                    self._name = record.map

    def learned(self) -> list[StoredRecord]:
        """Return what stands for all that was stored in this run: the map without its places."""
        remembered = self._maps.get(self._name)
        if remembered is None:
            return []
        return [each for each in (remembered.known, remembered.tree) if each is not None]

    def note(self, delta: Delta) -> None:
        """Note what a delta has changed."""
        self._changed.note(delta.operations)
        self._forgotten.note(delta)

    def note_all(self) -> None:
        """Take all of a graph that was loaded as a whole for changed."""
        self._changed.note_all(self._graph)
        remembered = self._maps.get(self._joined or self._name)
        self._forgotten.note_all(None if remembered is None else remembered.known)

    def on_broadcast(self, broadcast: Broadcast) -> None:
        """Let what is conscious cue what stood near it."""
        self._cues.on_broadcast(broadcast)

    def changes(self) -> Changes:
        """Return what has changed on the root map since it was stored."""
        forgotten = self._rename()
        records: list[StoredRecord] = [*self._changed.take(self._name, self._graph)]
        learned = self._learned()
        kept = [*learned, *self._forgotten.known]
        objects = stored_objects(self._name, kept, self._graph)
        if objects != self._objects:
            self._objects = objects
            records += objects

        tree = stored_tree(self._name, learned, self._graph)
        if tree != self._tree:
            self._tree = tree
            records += tree

        self._maps.put(records)
        return Changes(records, forgotten)

    def recall(self) -> Recollection | None:
        """Recall the stored map that the agent is on, if other objects than before show it now."""
        agent = self._graph.agent
        if agent is None or self._joined or RECOLLECTION_ID in self._graph.nodes:
            return None

        learned = self._learned()
        here = cues(learned, (agent.x_m, agent.y_m))
        labels = {node.label for node in here}
        if labels == self._cued:
            return None

        self._cued = labels
        others = self._compared(here)
        way = way_of(self._graph, learned)
        found = recalled(here, way, others, self._graph.cell_m(ROOT_MAP))
        return None if found is None else recollection(found)

    def returning(self, cycle: int) -> list[Object]:
        """Return the forgotten objects that come back, cued by what was conscious before `cycle`
        and by where the agent is.
        """
        return self._cues.cued(cycle, self._forgotten.known)

    def _compared(self, here: list[Object]) -> list[RememberedMap]:
        """Choose the stored maps to compare: all, or if many, those that `here` reminds of."""
        others = self._maps.others(self._name)
        if len(others) <= self._config.compared_maps:
            return others

        if self._associations is None:
            self._associations = Associations(self._config.sparse)
            for remembered in others:
                self._associations.learn(remembered.name, remembered.looks, remembered.at_m)

        looks = [node.look for node in here]
        at_m = np.array([(node.x_m, node.y_m) for node in here]).reshape(-1, 2)
        names = self._associations.reminded_of(looks, at_m)[: self._config.compared_maps]
        return [remembered for remembered in others if remembered.name in names]

    def _rename(self) -> list[str]:
        """Call the root map what it has turned out to be, or give it a name if it has none. Return
        the keys of the records under a name that no longer holds.
        """
        before = self._name
        self._name = self._joined or before or self._maps.next_name()
        if not before or self._name == before:
            return []

        self._changed.note_all(self._graph)
        return self._maps.forget(before)

    @property
    def _joined(self) -> str:
        """Return the name of the map that was joined to the root map; empty if none was."""
        root = self._graph.get(Map, ROOT_MAP)
        return "" if root is None else root.remembered

    def _learned(self) -> list[Object]:
        """Return the objects of the root map that were seen often enough to be learned."""
        learned = []
        for node in self._graph.of_kind(Object):
            if node.map == ROOT_MAP and node.sightings >= MIN_SIGHTINGS:
                learned.append(node)

        return learned
