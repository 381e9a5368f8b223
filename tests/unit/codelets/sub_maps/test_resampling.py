"""Place nodes of a grid with a frame of its own, from those of the root map."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.geometry.arrays import Singles
from cogmap.graph.window import CUT_BELOW, WEIGHT_COLUMNS, Extent, Window
from cogmap.schemas.nodes import PlaceColumn
from cogmap.services.codelets.planning.activation import spread
from cogmap.services.codelets.planning.network import PlaceNetwork
from cogmap.services.codelets.sub_maps.resampling import COLUMNS, Grid, cells_below, resampled

HALF = 70
AREA = Extent((-10, -10), (11, 11))
WEIGHTS = slice(2, 6)
EVIDENCE = slice(6, 10)


def _root() -> Window:
    """A window of free ground that was never seen, (0, 0) in its middle."""
    values = np.zeros((len(COLUMNS), 2 * HALF + 1, 2 * HALF + 1), np.float32)
    values[WEIGHTS] = 1.0
    return Window((-HALF, -HALF), COLUMNS, values)


def _random() -> Window:
    root = _root()
    rng = np.random.default_rng(9)
    root.values[:] = rng.random(root.values.shape)
    root.values[1] *= 0.4
    return root


def _walled(*gap: int) -> Window:
    """All links from i = 2 to i = 3 cut, but for those from and to j in a gap."""
    root = _root()
    east, north_east, north_west = (root.weights()[number] for number in (0, 1, 3))
    for weights, i in ((east, 2), (north_east, 2), (north_west, 3)):
        weights[HALF + i] = 0.0
        weights[HALF + i, [HALF + j for j in gap]] = 1.0
    return root


def _grid(x: float = 0.0, y: float = 0.0, heading_rad: float = 0.0, side: float = 1.0) -> Grid:
    return Grid(np.array([x, y, heading_rad]), side)


def _column(places: Singles, name: PlaceColumn, i: int, j: int) -> float:
    return float(places[COLUMNS.index(name), i - AREA.lower[0], j - AREA.lower[1]])


def _is_connected(root: Window, grid: Grid, start: tuple[int, int], goal: tuple[int, int]) -> bool:
    places = resampled(root, grid, AREA)
    open_links = np.where(places[WEIGHTS] >= CUT_BELOW, 1.0, 0.0).astype(np.float32)
    network = PlaceNetwork(AREA.lower, 1.0, open_links)
    return spread(network, np.array([goal])).arrives(start)


@pytest.mark.parametrize("shift", [0.0, 0.3, -0.5])
def test_a_grid_as_fine_as_the_root_map_has_its_places(shift: float) -> None:
    root = _random()
    places = resampled(root, _grid(x=4 + shift, y=-7 - shift), AREA)

    # Halfway between two places the upper one counts.
    i, j = round(4 + shift + 1e-3) + HALF - 10, round(-7 - shift + 1e-3) + HALF - 10
    expected = root.values[:, i : i + 21, j : j + 21].copy()
    expected[WEIGHTS][expected[WEIGHTS] < CUT_BELOW] = 0.0
    np.testing.assert_allclose(places, expected, atol=1e-6)


def test_a_turned_grid_has_turned_links() -> None:
    root = _random()
    places = resampled(root, _grid(heading_rad=math.pi / 2), AREA)

    # What is east in the grid is north on the root map.
    i, j = 3, 5
    east = _column(places, PlaceColumn.EVIDENCE_E, i, j)
    assert east == root.column(PlaceColumn.EVIDENCE_N)[HALF - j, HALF + i]
    north = _column(places, PlaceColumn.EVIDENCE_N, i, j)
    assert north == root.column(PlaceColumn.EVIDENCE_E)[HALF - j - 1, HALF + i]


def test_a_place_is_as_much_road_as_any_place_in_it_and_an_obstacle_on_average() -> None:
    root = _root()
    root.column(PlaceColumn.ROAD)[HALF + 9, HALF + 5] = 0.8
    root.column(PlaceColumn.OBSTACLE)[HALF + 9, HALF + 5] = 0.8
    places = resampled(root, _grid(x=1.5, y=1.5, side=4.0), AREA)

    # Cell (2, 1) of the grid has the places from (8, 4) to (11, 7).
    assert _column(places, PlaceColumn.ROAD, 2, 1) == pytest.approx(0.8)
    assert _column(places, PlaceColumn.OBSTACLE, 2, 1) == pytest.approx(0.05)
    assert places[:2].sum() == pytest.approx(0.85)


def test_a_link_is_as_free_as_the_best_row_and_that_as_its_weakest_link() -> None:
    root = _root()
    east = root.column(WEIGHT_COLUMNS[0])
    evidence = root.evidence()
    # From the middle of cell (0, 0) at (1, 1) to that of cell (1, 0) at (3, 1): straight on, or
    # aside at j = 0.
    evidence[:] = 1.5
    east[HALF + 1 : HALF + 3, HALF + 1] = 0.0, 1.0
    evidence[0, HALF + 1 : HALF + 3, HALF + 1] = -3.0, 2.0
    east[HALF + 1 : HALF + 3, HALF] = 0.9, 0.75
    evidence[0, HALF + 1 : HALF + 3, HALF] = 1.0, 0.5
    places = resampled(root, _grid(x=0.5, y=0.5, side=2.0), AREA)

    assert _column(places, PlaceColumn.WEIGHT_E, 0, 0) == 0.75
    assert _column(places, PlaceColumn.EVIDENCE_E, 0, 0) == 0.5
    assert _column(places, PlaceColumn.WEIGHT_E, 2, 0) == 1.0
    assert _column(places, PlaceColumn.EVIDENCE_E, 2, 0) == 1.5


@pytest.mark.parametrize("side", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("heading_rad", [0.0, 0.2, 0.8, 2.5])
def test_no_route_crosses_a_wall_however_the_grid_lies_but_through_a_wide_gap(
    side: float, heading_rad: float
) -> None:
    grid = _grid(0.3, -0.2, heading_rad, side)
    ends = np.array([[-3.0, 0.0], [9.0, 0.0]])
    turned = np.exp(-1j * heading_rad) * ((ends - grid.pose[:2]) @ [1, 1j]) / side
    start, goal = ((round(each.real), round(each.imag)) for each in turned.tolist())

    assert not _is_connected(_walled(), grid, start, goal)
    assert _is_connected(_walled(*range(-8, 9)), grid, start, goal)


def test_no_link_leads_to_where_something_stands() -> None:
    root = _root()
    root.column(PlaceColumn.OBSTACLE)[HALF + 4 : HALF + 6, HALF + 4 : HALF + 6] = 1.0
    places = resampled(root, _grid(x=0.5, y=0.5, side=2.0), AREA)

    assert _column(places, PlaceColumn.WEIGHT_E, 2, 2) == 0.0
    assert _column(places, PlaceColumn.WEIGHT_E, 1, 2) == 0.0
    assert _column(places, PlaceColumn.WEIGHT_N, 1, 2) == 1.0


def test_the_cells_below_are_all_that_a_rectangle_follows_from() -> None:
    root = _random()
    grid = _grid(2.2, 1.7, 0.7, 3.0)
    extent = Extent((-3, -2), (4, 2))
    below = cells_below(grid, extent)
    i, j = np.add(below.lower, HALF).tolist()
    width, height = below.shape
    part = Window(below.lower, COLUMNS, root.values[:, i : i + width, j : j + height])

    np.testing.assert_array_equal(resampled(part, grid, extent), resampled(root, grid, extent))
