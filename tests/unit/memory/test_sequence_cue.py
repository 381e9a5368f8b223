"""Recall where only two looks are about: by what was passed along the way."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_to
from cogmap.graph.graph import Graph
from cogmap.schemas.array import Matrix
from cogmap.schemas.memory import StoredObjects
from cogmap.schemas.nodes import (
    Object,
    PathColumn,
    PathSegment,
    individual_label,
    segment_id,
)
from cogmap.services.memory.maps import RememberedMap
from cogmap.services.memory.recall import Recalled, recalled
from cogmap.services.memory.sequence_cue import Way, way_of
from cogmap.testing import landmark

POSE = np.array([30.0, -10.0, 0.7])
STREET_M = np.column_stack([np.arange(0.0, 100.0), np.zeros(100)])
HOUSES_M = np.array([8.0, 17.0, 31.0, 38.0, 52.0, 63.0, 74.0, 88.0])
LOOKS = ["house", "house", "works", "house", "works", "house", "house", "house"]


def houses(looks: list[str], along_m: Floats, beside_m: float = 9.0) -> list[Object]:
    """Houses along a street, on both sides of it in turn."""
    nodes = []
    for number, (look, x_m) in enumerate(zip(looks, along_m.tolist(), strict=True), start=1):
        y_m = beside_m if number % 2 else -beside_m
        label = individual_label(number, 0)
        nodes.append(landmark(label, [(x_m, y_m)], names={look: 9.0}, sightings=9))

    return nodes


def learned(nodes: list[Object]) -> RememberedMap:
    """A stored map of these."""
    rows = [[node.x_m, node.y_m, 0.5, 0.5, 8.0, 6.0, 9.0] for node in nodes]
    known = StoredObjects(
        map="town",
        cell_m=1.0,
        labels=[node.label for node in nodes],
        names=[node.look for node in nodes],
        given_names=[""] * len(nodes),
        functions=[""] * len(nodes),
        objects=Matrix.of(rows),
    )
    return RememberedMap("town", known)


def seen_from(pose: Floats, nodes: list[Object]) -> list[Object]:
    """The same objects in the frame that has that pose."""
    moved = []
    for node in nodes:
        ((x_m, y_m),) = transform_to(pose, np.array([[node.x_m, node.y_m]])).tolist()
        moved.append(msgspec.structs.replace(node, x_m=x_m, y_m=y_m))

    return moved


def recall(nodes: list[Object], stored: RememberedMap, way_m: Floats) -> Recalled | None:
    """What is recalled on a way along these, in a frame of its own."""
    here = seen_from(POSE, nodes)
    return recalled(here, Way(transform_to(POSE, way_m), here), [stored], 1.0)


def test_a_street_of_two_looks_is_recalled_once_it_was_driven() -> None:
    street = houses(LOOKS, HOUSES_M)

    found = recall(street, learned(street), STREET_M)

    assert found is not None
    assert found.pose == pytest.approx(POSE, abs=1e-6)
    assert recall(street, learned(street), STREET_M[:30]) is None
    assert recall(street, learned(street), STREET_M[:0]) is None


def test_a_street_on_which_more_should_have_been_passed_is_another() -> None:
    street = houses(LOOKS, HOUSES_M)
    between = houses(["works"] * 4, HOUSES_M[:4] + 4.5)

    assert recall(street, learned([*street, *between]), STREET_M) is None


def test_what_stands_behind_the_first_row_need_not_have_been_seen() -> None:
    street = houses(LOOKS, HOUSES_M)
    behind = houses(["works"] * 4, HOUSES_M[:4] + 4.5, beside_m=30.0)

    assert recall(street, learned([*street, *behind]), STREET_M) is not None


def test_a_street_of_one_look_is_never_recalled() -> None:
    street = houses(["house"] * 8, HOUSES_M)

    assert recall(street, learned(street), STREET_M) is None


def test_the_way_is_that_of_the_last_segments_of_the_path() -> None:
    graph = Graph()
    for number in range(5):
        rows = np.zeros((2, len(PathColumn)))
        rows[:, PathColumn.X_M] = [2.0 * number, 2.0 * number + 1]
        graph.change([PathSegment(id=segment_id(number), number=number, rows=Matrix.of(rows))])

    assert way_of(graph, []).at_m[:, 0].tolist() == [4.0, 5.0, 6.0, 7.0, 8.0, 9.0]
