"""What is to be forgotten, found without visiting the rest of the graph."""

from __future__ import annotations

from collections import defaultdict

from cogmap.graph import decay
from cogmap.graph.graph import Graph
from cogmap.schemas.graph import Delta, DropNode
from cogmap.schemas.nodes import GraphNode

Buckets = defaultdict[int, dict[str, None]]


class Forgetting:
    """Nodes by the cycle at whose end they may be forgotten.

    A node stands in one bucket, at the latest when it is due: one that was written again since is
    moved to its new cycle when its old one comes.
    """

    def __init__(self) -> None:
        self._buckets: Buckets = defaultdict(dict)
        self._bucket_of: dict[str, int] = {}
        self._newest = -1

    def restore(self, graph: Graph) -> None:
        """Begin anew with all nodes of `graph`."""
        self._buckets.clear()
        self._bucket_of.clear()
        self._newest = graph.cycle - 1

        for node in graph.nodes.values():
            self._put(node, graph)

    def note(self, delta: Delta, graph: Graph) -> None:
        """Take up the nodes that a delta has written."""
        for operation in delta.operations:
            if isinstance(operation, GraphNode):
                self._put(operation, graph)

    def due(self, graph: Graph) -> list[DropNode]:
        """Return the nodes to be forgotten at the end of the current cycle, by id."""
        forgotten = []
        for cycle in range(self._newest + 1, graph.cycle + 1):
            for name in self._buckets.pop(cycle, {}):
                self._bucket_of.pop(name, None)
                node = graph.nodes.get(name)
                if node is None:
                    continue

                if decay.cycle_of_forgetting(node, graph.decay) <= graph.cycle:
                    forgotten.append(node.id)
                else:
                    self._put(node, graph)

        self._newest = max(self._newest, graph.cycle)
        return [DropNode(id=name) for name in sorted(forgotten)]

    def _put(self, node: GraphNode, graph: Graph) -> None:
        end_cycle = decay.cycle_of_forgetting(node, graph.decay)
        cycle = max(end_cycle, self._newest + 1)
        if cycle >= decay.NEVER:
            return

        bucket = self._bucket_of.get(node.id)
        if bucket is not None and bucket <= cycle:
            return

        if bucket is not None:
            self._buckets[bucket].pop(node.id, None)
        self._buckets[cycle][node.id] = None
        self._bucket_of[node.id] = cycle
