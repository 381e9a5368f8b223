"""Rectangles of place nodes as dense arrays, and the links that lines cross."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.graph.crossings import crossings
from cogmap.graph.window import EVIDENCE_COLUMNS, LINK_OFFSETS, WEIGHT_COLUMNS, Extent
from cogmap.schemas.nodes import ROOT_MAP, TILE_SIDE, Map, PlaceColumn
from cogmap.testing import cells, graph_of

FAR = 2**19
Link = tuple[int, int, int]


def test_a_window_has_the_values_of_its_cells_across_tiles() -> None:
    graph = graph_of(
        cells(PlaceColumn.ROAD, {(-1, TILE_SIDE): 0.5}),
        cells(PlaceColumn.OBSTACLE, {(2, TILE_SIDE - 1): 0.25}),
    )
    extent = Extent((-3, TILE_SIDE - 2), (4, TILE_SIDE + 3))
    window = graph.places.window(ROOT_MAP, [PlaceColumn.ROAD, PlaceColumn.OBSTACLE], extent)

    assert window.origin == (-3, TILE_SIDE - 2)
    assert window.shape == (7, 5)
    road = window.column(PlaceColumn.ROAD)
    obstacle = window.column(PlaceColumn.OBSTACLE)
    assert (road[2, 2], road.sum()) == (0.5, 0.5)
    assert (obstacle[5, 1], obstacle.sum()) == (0.25, 0.25)


def test_a_window_without_an_extent_holds_all_tiles_of_its_map() -> None:
    fine = Map(id="map:fine", cell_m=0.5, parent=ROOT_MAP)
    graph = graph_of(
        fine,
        cells(PlaceColumn.ROAD, {(-1, -1): 1.0}),
        cells(PlaceColumn.ROAD, {(TILE_SIDE, 0): 1.0}),
        cells(PlaceColumn.ROAD, {(500, 500): 1.0}, "map:fine"),
    )
    window = graph.places.window(ROOT_MAP, [PlaceColumn.ROAD])

    assert window.origin == (-TILE_SIDE, -TILE_SIDE)
    assert window.shape == (3 * TILE_SIDE, 2 * TILE_SIDE)
    assert window.values.sum() == 2.0


def test_a_map_without_place_nodes_has_an_empty_window() -> None:
    window = graph_of().places.window(ROOT_MAP, WEIGHT_COLUMNS)

    assert window.values.shape == (4, 0, 0)


def test_links_that_were_never_seen_are_free_and_have_no_evidence() -> None:
    graph = graph_of(cells(PlaceColumn.EVIDENCE_N, {(0, 0): -2.0}))
    extent = Extent((0, 0), (TILE_SIDE, 2 * TILE_SIDE))
    window = graph.places.window(ROOT_MAP, [*EVIDENCE_COLUMNS, *WEIGHT_COLUMNS], extent)

    assert (window.weights() == 1.0).all()
    seen = np.argwhere(window.evidence() != 0)
    assert seen.tolist() == [[2, 0, 0]]


def test_a_window_does_not_change_with_the_graph() -> None:
    graph = graph_of(cells(PlaceColumn.ROAD, {(0, 0): 0.5}))
    window = graph.places.window(ROOT_MAP, [PlaceColumn.ROAD])
    graph.change([cells(PlaceColumn.ROAD, {(0, 0): 1.0})])

    assert window.column(PlaceColumn.ROAD)[0, 0] == 0.5


def test_a_window_too_large_for_memory_is_refused() -> None:
    graph = graph_of(
        cells(PlaceColumn.ROAD, {(-FAR, -FAR): 1.0}),
        cells(PlaceColumn.ROAD, {(FAR, FAR): 1.0}),
    )
    with pytest.raises(MessageError, match="ask for a part of the map"):
        graph.places.window(ROOT_MAP, [PlaceColumn.ROAD])

    corner = Extent((FAR, FAR), (FAR + 1, FAR + 1))
    window = graph.places.window(ROOT_MAP, [PlaceColumn.ROAD], corner)
    assert window.values.tolist() == [[[1.0]]]


def _cross(one: np.ndarray, other: np.ndarray) -> float:
    return float(one[0] * other[1] - one[1] * other[0])


def _meet(start: np.ndarray, end: np.ndarray, here: np.ndarray, there: np.ndarray) -> bool:
    """Whether two straight segments meet inside both."""
    along = end - start
    link = there - here
    sides = _cross(along, here - start) * _cross(along, there - start)
    ends = _cross(link, start - here) * _cross(link, end - here)
    return sides < 0 and ends < 0


def _links_met(start: np.ndarray, end: np.ndarray) -> set[Link]:
    """The links that a segment crosses, each of those around it tried."""
    met = set()
    for i in range(-12, 12):
        for j in range(-12, 12):
            for direction, offset in enumerate(LINK_OFFSETS):
                here = np.array([i, j])
                if _meet(start, end, here, here + offset):
                    met.add((direction, i, j))

    return met


def test_lines_cross_the_links_that_they_meet_in_all_directions() -> None:
    rng = np.random.default_rng(5)
    starts = rng.uniform(-5, 5, (6, 2))
    ends = starts + rng.uniform(-4, 4, (6, 2))
    found = crossings(starts, ends)

    for number, (start, end) in enumerate(zip(starts, ends, strict=True)):
        of_segment = found.segment == number
        links = np.column_stack([found.direction, found.i, found.j])[of_segment]
        assert len(links) > 0
        assert {tuple(link) for link in links.tolist()} == _links_met(start, end)


def test_a_line_that_ends_on_a_link_crosses_it_with_the_next() -> None:
    corner = np.array([[0.0, 0.5], [0.5, 0.5]])
    onwards = np.array([[0.5, 0.5], [0.5, 1.5]])
    points = np.concatenate([corner[:1], onwards])
    found = crossings(points[:-1], points[1:])
    links = np.column_stack([found.direction, found.i, found.j]).tolist()

    assert links.count([3, 1, 0]) == 1
    assert links.count([0, 0, 1]) == 1


def test_no_line_crosses_nothing() -> None:
    found = crossings(np.zeros((0, 2)), np.zeros((0, 2)))

    assert found.direction.size == 0
