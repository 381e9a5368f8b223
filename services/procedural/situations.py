"""What the graph adds to a broadcast: the situation of its cycle. Pure."""

from __future__ import annotations

from collections.abc import Iterable

from cogmap.errors import ConfigError
from cogmap.graph.graph import Graph
from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import KINDS, GraphNode, kind_name
from cogmap.services.procedural.patterns import Active

BEFORE_POSE = frozenset({Phase.PERCEPTS, Phase.CORRECTION})
# A bound on memory: 13 s at five cycles a second.
REMEMBERED_CYCLES = 64


class Situations:
    """Nodes of certain kinds as they were when each cycle's pose was committed.

    A broadcast ends its cycle somewhat later, when the graph may have changed already: by what, is
    a matter of time. So the situation of a cycle is that of its pose.
    """

    def __init__(self, kinds: Iterable[str], share: float) -> None:
        """What is not conscious counts with that `share` of its activation. Raises ConfigError
        where a kind is unknown, or not one that the graph finds by kind.
        """
        self._share = share
        indexed = {kind_name(kind): kind for kind, rules in KINDS.items() if rules.indexed}
        self._kinds: list[type[GraphNode]] = []
        for name in sorted({*kinds}):
            if name not in indexed:
                known = ", ".join(sorted(indexed))
                raise ConfigError(f"procedural.graph_kinds names {name!r}: there are {known}")
            self._kinds.append(indexed[name])

        self._cycle = 0
        self._is_settled = False
        self._nodes: dict[int, tuple[Active, ...]] = {}

    def on_load(self, graph: Graph) -> None:
        """Start anew: the graph was replaced as a whole, and may be that of another run."""
        self._nodes.clear()
        self._cycle = 0
        self.on_graph(graph, graph.phase)

    def on_graph(self, graph: Graph, phase: Phase) -> None:
        """Note that the graph is now as after this phase of its cycle."""
        if graph.cycle != self._cycle:
            self._cycle = graph.cycle
            self._is_settled = False
        if self._is_settled:
            return

        self._is_settled = phase not in BEFORE_POSE
        has_pose = not self._is_settled or phase is Phase.LOCALIZATION
        if has_pose or graph.cycle not in self._nodes:
            nodes = []
            for kind in self._kinds:
                for node in graph.of_kind(kind):
                    nodes.append(Active(node, self._share * graph.total_activation(node)))
            self._nodes[graph.cycle] = tuple(nodes)
        while len(self._nodes) > REMEMBERED_CYCLES:
            del self._nodes[min(self._nodes)]

    def is_settled(self, cycle: int) -> bool:
        """Decide whether the pose of a cycle is committed, or that of a later one."""
        return self._cycle > cycle or (self._cycle == cycle and self._is_settled)

    def of(self, broadcast: Broadcast) -> tuple[Active, ...]:
        """Return the nodes of a broadcast, and those of its cycle that it has not."""
        nodes = []
        for node in broadcast.coalition.nodes:
            activation = min(1.0, node.base_level + node.activation)
            nodes.append(Active(node, activation, broadcast.coalition.feeling))

        if not self._nodes:
            return tuple(nodes)

        # Of the last cycle up to that of the broadcast, of the oldest one if none is as old.
        known = {active.node.id for active in nodes}
        cycles = [each for each in self._nodes if each <= broadcast.cycle]
        kept = self._nodes[max(cycles, default=min(self._nodes))]
        nodes += [each for each in kept if each.node.id not in known]
        return tuple(nodes)
