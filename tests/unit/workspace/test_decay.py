from __future__ import annotations

import numpy as np
import pytest

from cogmap.graph.graph import Graph
from schemas.array import Array
from schemas.graph import Activations, Cells, DropNode, Link, Node
from services.workspace.decay import fade
from services.workspace.module import Config
from tests.support.scenes import Desk, node, percept


def _graph(*nodes: Node) -> Graph:
    graph = Graph()
    graph.change([*nodes])
    return graph


def _node(name: str, activation: float, base_level: float = 0.0, kind: str = "object") -> Node:
    return Node(id=name, kind=kind, activation=activation, base_level=base_level)


def _tick(graph: Graph, ticks: int = 1, **settings: float) -> None:
    for _ in range(ticks):
        graph.change(fade(graph, Config(**settings)))  # type: ignore[arg-type]


def test_activation_falls_by_a_tenth_a_tick_and_base_level_by_far_less() -> None:
    graph = _graph(_node("a", 0.9, 0.5))
    _tick(graph, 3)
    assert graph.nodes["a"].activation == pytest.approx(0.6, abs=1e-6)
    assert graph.nodes["a"].base_level == pytest.approx(0.4985, abs=1e-6)


def test_activation_never_falls_below_zero() -> None:
    graph = _graph(_node("a", 0.05, 0.5))
    _tick(graph, 3)
    assert graph.nodes["a"].activation == 0.0


@pytest.mark.parametrize("kind", ["path", "closure", "correction"])
def test_what_the_agent_knows_of_its_way_does_not_fade(kind: str) -> None:
    graph = _graph(node("a", kind=kind))
    for _ in range(30):
        _tick(graph)
    assert "a" in graph.nodes


def test_the_self_node_does_not_fade() -> None:
    graph = _graph(_node("self", 1.0, 1.0, "self"))
    _tick(graph, 100)
    assert graph.nodes["self"] == _node("self", 1.0, 1.0, "self")


def test_what_falls_below_threshold_is_forgotten_with_its_links() -> None:
    graph = _graph(_node("a", 0.3), _node("b", 1.0, 0.5))
    graph.change([Link(source="b", target="a")])
    _tick(graph, 2)
    assert sorted(graph.nodes) == ["a", "b"]
    _tick(graph)
    assert sorted(graph.nodes) == ["b"]
    assert graph.snapshot().links == []


def test_base_level_keeps_a_node_that_activation_alone_would_not() -> None:
    graph = _graph(_node("seen once", 1.0, 0.0), _node("learned", 0.0, 0.2))
    _tick(graph, 20)
    assert list(graph.nodes) == ["learned"]


def test_decay_says_results_so_applying_it_twice_changes_nothing() -> None:
    graph = _graph(_node("a", 0.9, 0.5), _node("b", 0.1), _node("c", 0.4, 0.1))
    cells = np.array([[0, 0], [-40, 7]], np.int32)
    graph.change(
        [Cells(column="activation", cells=Array.of(cells), values=Array.of(np.ones(2, np.float32)))]
    )
    operations = fade(graph, Config())
    graph.change(operations)
    once = graph.digest()
    graph.change(operations)
    assert graph.digest() == once
    assert {type(operation) for operation in operations} == {Activations, Cells, DropNode}


def test_place_nodes_fade_to_zero_and_are_then_no_longer_spoken_of() -> None:
    graph = Graph()
    here = Array.of(np.array([[-3, 70]], np.int32))
    graph.change(
        [Cells(column="activation", cells=here, values=Array.of(np.full(1, 0.05, np.float32)))]
    )
    trace = []
    for _ in range(4):
        place = graph.place(-3, 70)
        assert place is not None
        trace.append(place.activation)
        _tick(graph)
    assert trace == pytest.approx([0.05, 0.03, 0.01, 0.0], abs=1e-6)
    assert fade(graph, Config()) == []


def test_road_marks_do_not_fade() -> None:
    graph = Graph()
    here = Array.of(np.array([[1, 1]], np.int32))
    graph.change([Cells(column="road", cells=here, values=Array.of(np.ones(1, np.float32)))])
    _tick(graph, 10)
    place = graph.place(1, 1)
    assert place is not None
    assert place.attributes["road"] == 1.0


def test_an_object_that_is_no_longer_seen_stays_on_the_map_and_its_percept_goes() -> None:
    desk = Desk("w1")
    desk.drive(range(3), percept("a"))
    desk.drive(range(3, 15))
    assert {"self", "path:0", "sighted:0:a", "object:a"} == set(desk.graph.nodes)


def test_a_replica_fades_as_the_workspace_does() -> None:
    desk = Desk("w1", decay=0.3, base_level_decay=0.1)
    desk.drive(range(2), percept("a"), percept("b", 0.7))
    desk.drive(range(2, 12))
    assert set(desk.graph.nodes) == {"self", "path:0", "sighted:0:a", "sighted:0:b"}
    assert desk.graph.digest() == desk.digest


def test_fading_leaves_the_nodes_that_messages_hold_as_they_are() -> None:
    said = node("a")
    graph = _graph(said)
    _tick(graph)
    assert said.activation == 1.0
