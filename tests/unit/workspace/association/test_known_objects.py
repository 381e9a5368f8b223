"""The objects of a graph, found by place, name and look, as deltas come and go."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.graph import Delta, DropNode, Operation, Phase
from cogmap.schemas.nodes import ROOT_MAP, Object
from cogmap.schemas.sensing import Appearance
from cogmap.services.workspace.association.known_objects import MAX_ALIKE, KnownObjects
from cogmap.testing import graph_of, landmark


def _house(label: str, x_m: float, y_m: float = 0.0, name: str = "inn", **facts: object) -> Object:
    return landmark(label, [(x_m, y_m)], **({"names": {name: 1.0}} | facts))


def _known(*objects: Object) -> tuple[Graph, KnownObjects]:
    graph = graph_of(*objects)
    known = KnownObjects(graph)
    known.restore()
    return graph, known


def _commit(graph: Graph, known: KnownObjects, *operations: Operation) -> None:
    delta = Delta(
        version=graph.version + 1, cycle=graph.cycle + 1, phase=Phase.END, operations=[*operations]
    )
    assert graph.apply(delta)
    known.note(delta)


def _labels(objects: list[Object]) -> list[str]:
    return sorted(node.label for node in objects)


def test_objects_near_a_position_are_found_and_no_distant_ones() -> None:
    _, known = _known(_house("41a", 5.0), _house("52b", -5.0, -5.0), _house("63c", 200.0))

    assert _labels(known.near(ROOT_MAP, 0.0, 0.0, 10.0)) == ["41a", "52b"]
    assert _labels(known.near(ROOT_MAP, 195.0, 0.0, 10.0)) == ["63c"]


def test_objects_of_another_map_are_not_found() -> None:
    _, known = _known(_house("41a", 5.0, map="map:3"))

    assert known.near(ROOT_MAP, 5.0, 0.0, 10.0) == []
    assert _labels(known.near("map:3", 5.0, 0.0, 10.0)) == ["41a"]


def test_objects_of_a_name_are_found_and_counted() -> None:
    _, known = _known(_house("41a", 5.0), _house("52b", 200.0), _house("63c", 9.0, name="mill"))

    assert _labels(known.called("inn")) == ["41a", "52b"]
    assert (known.count_called("inn"), known.count_called("barn")) == (2, 0)
    assert len(known) == 3


def test_of_very_many_of_one_name_all_are_counted_and_some_are_compared() -> None:
    _, known = _known(*[_house(f"{number}a", 8.0 * number) for number in range(MAX_ALIKE + 9)])

    assert len(known.called("inn")) == MAX_ALIKE
    assert known.count_called("inn") == MAX_ALIKE + 9


def test_an_object_that_a_delta_moves_or_names_is_found_by_that() -> None:
    graph, known = _known(_house("41a", 5.0))
    _commit(graph, known, _house("41a", 205.0, name="mill"))

    assert known.near(ROOT_MAP, 5.0, 0.0, 10.0) == []
    assert _labels(known.near(ROOT_MAP, 205.0, 0.0, 10.0)) == ["41a"]
    assert _labels(known.called("mill")) == ["41a"]
    assert known.count_called("inn") == 0


def test_an_object_that_a_delta_drops_is_not_found_any_more() -> None:
    node = _house("41a", 5.0, appearances=_sides(0.0))
    graph, known = _known(node)
    _commit(graph, known, DropNode(id=node.id))

    assert known.near(ROOT_MAP, 5.0, 0.0, 10.0) == []
    assert (len(known), known.has_appearances) == (0, False)


def test_begun_anew_it_has_what_the_graph_has_and_nothing_else() -> None:
    graph, known = _known(_house("41a", 5.0, appearances=_sides(0.0)))
    graph.load(graph_of(_house("52b", 6.0)).snapshot())
    known.restore()

    assert _labels(known.near(ROOT_MAP, 5.0, 0.0, 10.0)) == ["52b"]
    assert not known.has_appearances


def test_objects_are_compared_by_the_side_that_is_most_like_what_is_seen() -> None:
    both = _house("41a", 5.0, appearances=_sides(0.0, math.pi / 2))
    one = _house("52b", 6.0, appearances=_sides(math.pi))
    _, known = _known(both, one, _house("63c", 7.0))
    nodes, cosines = known.alike(_seen(math.pi / 2))

    assert [node.label for node in nodes] == ["41a", "52b"]
    assert cosines == pytest.approx([1.0, 0.0], abs=1e-3)


def test_a_side_that_is_learned_is_compared_from_then_on() -> None:
    graph, known = _known(_house("41a", 5.0, appearances=_sides(0.0)))
    known.alike(_seen(math.pi / 2))
    _commit(graph, known, _house("41a", 5.0, appearances=_sides(0.0, math.pi / 2)))
    _, cosines = known.alike(_seen(math.pi / 2))

    assert cosines == pytest.approx([1.0], abs=1e-3)


def _sides(*angles_rad: float) -> Matrix:
    return Matrix.of(np.array([[math.cos(each), math.sin(each)] for each in angles_rad]), "<f2")


def _seen(angle_rad: float) -> Appearance:
    direction = np.array([math.cos(angle_rad), math.sin(angle_rad)], np.float32)
    return Appearance(direction=Array.of(direction), sharpness=10.0, even_cosine=0.5)
