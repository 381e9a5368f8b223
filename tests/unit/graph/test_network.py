"""The graph in networkx."""

from __future__ import annotations

import networkx
import pytest

from cogmap import as_networkx, open_log
from cogmap.graph.graph import Graph
from cogmap.schemas.graph import Link
from cogmap.schemas.nodes import LinkKind, Object
from tests.support.reference import REFERENCE


@pytest.fixture(scope="module")
def graph() -> Graph:
    """That of the end of the reference drive."""
    log = open_log(REFERENCE)
    return log.graph_at(log.duration_s)


def test_every_node_is_there_with_its_kind_and_fields(graph: Graph) -> None:
    network = as_networkx(graph)

    assert set(graph.nodes) <= set(network.nodes)
    for node in graph.of_kind(Object):
        attributes = network.nodes[node.id]
        assert attributes["kind"] == "object"
        assert attributes["label"] == node.label
        assert attributes["x_m"] == node.x_m
        assert attributes["activation"] == graph.activation(node)


def test_every_link_is_there_by_its_kind_and_weight(graph: Graph) -> None:
    network = as_networkx(graph)
    links = [
        (source, target, str(each.kind), weight)
        for each in graph.links.in_bulk()
        for source, weights in each.weights.items()
        for target, weight in weights.items()
    ]

    assert links
    assert sorted(links) == sorted(network.edges(keys=True, data="weight"))


def test_its_algorithms_answer() -> None:
    graph = Graph()
    graph.change(
        [
            Object(id="object:1a", label="1a", x_m=0.0, y_m=0.0),
            Object(id="object:1b", label="1b", x_m=3.0, y_m=4.0),
            Link(source="object:1a", target="map:1", kind=LinkKind.WITHIN),
            Link(source="object:1b", target="map:1", kind=LinkKind.WITHIN),
        ]
    )
    around = networkx.Graph(as_networkx(graph))

    assert networkx.shortest_path(around, "object:1a", "object:1b") == [
        "object:1a",
        "map:1",
        "object:1b",
    ]
