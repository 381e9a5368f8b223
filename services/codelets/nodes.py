"""Nodes of the graph, many at once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import GraphNode

K = TypeVar("K", bound=GraphNode)


def nodes_of(graph: Graph, kind: type[K], names: Iterable[str]) -> list[K]:
    """Return the nodes of that kind that the graph has by these ids, in their order."""
    found = []
    for name in names:
        node = graph.get(kind, name)
        if node is not None:
            found.append(node)

    return found
