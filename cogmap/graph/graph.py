"""The Current Situational Model in memory: what the workspace writes and every replica follows."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from operator import attrgetter
from typing import Any, TypeVar

import msgspec

from cogmap.bus.codec import encode
from cogmap.graph import decay, lineage
from cogmap.graph.links import LinkIndex
from cogmap.graph.places import Place, PlaceGrid
from cogmap.schemas.graph import (
    Cells,
    Decay,
    Delta,
    DropLink,
    DropNode,
    DropPlaces,
    Link,
    Links,
    Operation,
    Phase,
    PlaceTile,
    Snapshot,
)
from cogmap.schemas.nodes import (
    KINDS,
    ROOT_MAP,
    SELF_ID,
    AnyNode,
    GraphNode,
    Map,
    PathSegment,
    Self,
)

K = TypeVar("K", bound=GraphNode)
_INDEXED = frozenset(kind for kind, rules in KINDS.items() if rules.indexed)


class Graph:
    """Nodes, links and place nodes at one version.

    `phase` is that of the newest commit that was not late, in cognitive cycle `cycle`. Nodes are
    shared and never changed: a commit replaces them. All nodes of an indexed kind are found without
    a search. A replica that needs no place nodes, the bulk of what changes, leaves them out by
    `with_places`. `lineage` is a digest of all commits; None after a snapshot that states none.
    """

    def __init__(self, with_places: bool = True) -> None:
        self.version = 0
        self.cycle = 0
        self.phase = Phase.END
        self.decay = Decay()
        self.lineage: str | None = lineage.FIRST

        self.nodes: dict[str, AnyNode] = {}
        self.links = LinkIndex(self._name_of)
        self.places = PlaceGrid()
        self._by_kind: dict[type, dict[str, None]] = {kind: {} for kind in _INDEXED}

        self._appliers: dict[type, Callable[[Any], None]] = {
            Link: self._put_link,
            Links: self.links.put_all,
            PlaceTile: self.places.put_tile if with_places else _leave_out,
            DropNode: self._drop_node,
            DropPlaces: self._drop_places,
            DropLink: self._drop_link,
            Cells: self.places.put_cells if with_places else _leave_out,
            Decay: self._put_decay,
        }

    def apply(self, delta: Delta) -> bool:
        """Carry out the next commit.

        False if it is not the next one: an old one changes nothing, and a gap remains.
        """
        if delta.version != self.version + 1:
            return False

        self.change(delta.operations)
        if self.lineage is None and delta.lineage is not msgspec.UNSET:
            self.lineage = delta.lineage
        if self.lineage is not None:
            self.lineage = lineage.after(self.lineage, delta)
        self.version = delta.version
        self.cycle = delta.cycle
        if delta.phase is not Phase.LATE:
            self.phase = delta.phase
        return True

    def change(self, operations: list[Operation]) -> None:
        """Carry out operations, in order."""
        nodes = self.nodes
        by_kind = self._by_kind
        appliers = self._appliers
        for operation in operations:
            kind = type(operation)
            apply = appliers.get(kind)
            if apply is not None:
                apply(operation)
                continue

            identifier = operation.id  # type: ignore[union-attr]
            nodes[identifier] = operation  # type: ignore[assignment]
            if kind in by_kind:
                by_kind[kind][identifier] = None

    @property
    def agent(self) -> Self | None:
        """Return the self node; None before the first cycle."""
        node = self.nodes.get(SELF_ID)
        return node if isinstance(node, Self) else None

    def get(self, kind: type[K], identifier: str) -> K | None:
        """Return the node of that kind and id; None if there is none."""
        node = self.nodes.get(identifier)
        return node if isinstance(node, kind) else None

    def of_kind(self, kind: type[K]) -> Iterator[K]:
        """Yield all nodes of a kind, by id. If the kind is not indexed, it searches every node."""
        names = self._by_kind.get(kind, self.nodes)

        for name in sorted(names):
            node = self.nodes[name]
            if isinstance(node, kind):
                yield node

    def count(self, kind: type[GraphNode]) -> int:
        """Return how many nodes of an indexed kind there are."""
        return len(self._by_kind[kind])

    @property
    def path(self) -> list[PathSegment]:
        """Return the segments of the path, the oldest first."""
        return sorted(self.of_kind(PathSegment), key=attrgetter("number"))

    @property
    def last_segment(self) -> PathSegment | None:
        """Return the newest segment of the path; None if there is none."""
        return max(self.of_kind(PathSegment), key=attrgetter("number"), default=None)

    def cell_m(self, map_id: str = ROOT_MAP) -> float:
        """Return the distance between neighbouring place nodes of a map."""
        node = self.get(Map, map_id)
        if node is None:
            return 1.0
        return node.cell_m

    def activation(self, node: GraphNode) -> float:
        """Return a node's activation in the current cycle."""
        return decay.activation(node, self.cycle, self.decay)

    def base_level(self, node: GraphNode) -> float:
        """Return a node's base-level activation in the current cycle."""
        return decay.base_level(node, self.cycle, self.decay)

    def total_activation(self, node: GraphNode) -> float:
        """Return a node's total activation in the current cycle."""
        return decay.total_activation(node, self.cycle, self.decay)

    def place(self, i: int, j: int, map_id: str = ROOT_MAP) -> Place | None:
        """Return the place node of a cell; None if its tile does not exist."""
        return self.places.place(
            map_id,
            i,
            j,
            cell_m=self.cell_m(map_id),
            cycle=self.cycle,
            decay=self.decay.place_activation,
        )

    def place_links(self, i: int, j: int, map_id: str = ROOT_MAP) -> Iterator[Link]:
        """Return the links from a place node to its neighbours."""
        return self.places.links(map_id, i, j)

    def snapshot(self) -> Snapshot:
        """Return everything, in an order that depends on the content alone.

        Its tiles share memory with the graph: encode it before the graph changes.
        """
        nodes = [self.nodes[identifier] for identifier in sorted(self.nodes)]
        return Snapshot(
            version=self.version,
            cycle=self.cycle,
            phase=self.phase,
            decay=self.decay,
            nodes=nodes,
            links=list(self.links.in_bulk()),
            tiles=list(self.places.messages()),
            lineage=self.lineage or msgspec.UNSET,
        )

    def load(self, snapshot: Snapshot) -> None:
        """Replace everything by `snapshot`."""
        self.nodes.clear()
        self.links.clear()
        self.places.clear()
        for names in self._by_kind.values():
            names.clear()

        self.change([snapshot.decay, *snapshot.nodes, *snapshot.links, *snapshot.tiles])
        self.lineage = snapshot.lineage or None
        self.version = snapshot.version
        self.cycle = snapshot.cycle
        self.phase = snapshot.phase

    def digest(self) -> str:
        """Return a hash of the content: two graphs are equal if and only if their digests are."""
        content = encode(msgspec.structs.replace(self.snapshot(), lineage=msgspec.UNSET))
        return hashlib.blake2b(content, digest_size=16).hexdigest()

    def _name_of(self, identifier: str) -> str:
        """Return the string that already names a node; `identifier` itself if there is no node."""
        node = self.nodes.get(identifier)
        return identifier if node is None else node.id

    def _put_link(self, link: Link) -> None:
        self.links.put(link.kind, link.source, link.target, link.weight)

    def _drop_link(self, drop: DropLink) -> None:
        self.links.drop(drop.kind, drop.source, drop.target)

    def _drop_node(self, drop: DropNode) -> None:
        node = self.nodes.pop(drop.id, None)
        if node is None:
            return

        if type(node) in self._by_kind:
            self._by_kind[type(node)].pop(drop.id, None)
        self.links.drop_node(drop.id)
        if isinstance(node, Map):
            self.places.drop_map(drop.id)

    def _drop_places(self, drop: DropPlaces) -> None:
        self.places.drop_map(drop.map)

    def _put_decay(self, rates: Decay) -> None:
        self.decay = rates


def _leave_out(operation: Operation) -> None:
    """Leave out an operation on what a graph does not hold."""
