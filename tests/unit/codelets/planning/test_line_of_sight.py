"""Routes along lines of sight: straight where that is no dearer."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.planning.line_of_sight import straight, straightened
from cogmap.services.codelets.planning.network import grid_network

CLEAR = np.ones((40, 40))


def _bent() -> Indices:
    """A route that leads along one axis first, then along the diagonal."""
    along = [(i, 10) for i in range(20)]
    across = [(20 + i, 10 + i) for i in range(11)]
    return np.array(along + across)


def _aside(route: Floats) -> float:
    """How far a route leads away from the line between its ends, in cells."""
    away = route - route[0]
    x, y = (route[-1] - route[0]) / np.hypot(*(route[-1] - route[0]))
    return float(np.abs(away[:, 1] * x - away[:, 0] * y).max())


def _cells(line: Floats) -> Indices:
    """The cells that a line leads over."""
    return np.rint(line).astype(np.int64)


def test_over_clear_ground_a_route_leads_straight_to_its_end() -> None:
    line = straightened(_bent(), CLEAR, np.isfinite(CLEAR), (0, 0))

    assert _aside(_bent().astype(np.float64)) > 2.0
    assert _aside(line) < 0.02


def test_a_straight_route_leads_from_neighbour_to_neighbour() -> None:
    route = _cells(straightened(_bent(), CLEAR, np.isfinite(CLEAR), (0, 0)))

    assert route[0].tolist() == [0, 10]
    assert route[-1].tolist() == [30, 20]
    assert np.abs(np.diff(route, axis=0)).max(axis=1).tolist() == [1] * (len(route) - 1)


def test_a_straight_route_is_no_longer_by_its_links() -> None:
    network = grid_network(CLEAR == 1)

    route = _cells(straightened(_bent(), CLEAR, np.isfinite(CLEAR), (0, 0)))

    assert network.cost_m(route) <= network.cost_m(_bent())


def _walled(wall: tuple[slice, slice]) -> Floats:
    """The costs of clear ground but for a wall."""
    cost = CLEAR.copy()
    cost[wall] = np.inf
    return cost


def test_a_straight_route_leads_over_no_ground_that_is_not_clear() -> None:
    cost = _walled((slice(5, 25), slice(12, 14)))
    before = [(0, j) for j in range(5, 9)] + [(j - 8, j) for j in range(9, 13)]
    after = [(4, 13), (5, 14), *((i, 14) for i in range(6, 20))]
    route = _cells(straightened(np.array(before + after), cost, np.isfinite(cost), (0, 0)))

    assert np.isfinite(cost[tuple(route.T)]).all()
    assert route.tolist() != before + after


def test_a_straight_route_passes_diagonally_between_no_two_corners() -> None:
    cost = _walled((slice(11, 40), slice(0, 11)))
    bend = [(i, 10) for i in range(5, 11)] + [(10, 11), *((i, 11) for i in range(11, 16))]
    route = _cells(straightened(np.array(bend), cost, np.isfinite(cost), (0, 0)))

    i, j = route.T
    assert np.isfinite(cost[i[1:], j[:-1]]).all()
    assert np.isfinite(cost[i[:-1], j[1:]]).all()


def test_a_line_over_dearer_ground_is_not_taken() -> None:
    cost = np.full(CLEAR.shape, 2.0)
    cost[tuple(_bent().T)] = 1.0

    assert straightened(_bent(), cost, np.isfinite(cost), (0, 0)).tolist() == _bent().tolist()


def test_a_line_beside_what_stands_there_is_not_taken() -> None:
    is_clear = np.zeros(CLEAR.shape, bool)

    assert straightened(_bent(), CLEAR, is_clear, (0, 0)).tolist() == _bent().tolist()


def test_a_line_passes_diagonally_beside_free_places_that_are_not_clear() -> None:
    route = np.array([(0, 0), (1, 0), (2, 1), (3, 2), (4, 3)])
    is_clear = np.zeros(CLEAR.shape, bool)
    is_clear[tuple(route.T)] = True
    for end in range(2, len(route)):
        cells, _ = straight(route[:1], route[end : end + 1])
        is_clear[tuple(cells[0].T)] = True
    assert not is_clear[4, 2]

    assert _aside(straightened(route, CLEAR, is_clear, (0, 0))) < 0.02


def test_a_route_is_straightened_wherever_its_ground_begins() -> None:
    origin = np.array([-7, 12])
    route = straightened(_bent() + origin, CLEAR, np.isfinite(CLEAR), (-7, 12))

    assert (
        route.tolist()
        == (straightened(_bent(), CLEAR, np.isfinite(CLEAR), (0, 0)) + origin).tolist()
    )


def test_a_route_of_one_place_stays() -> None:
    assert straightened(np.array([[3, 4]]), CLEAR, np.isfinite(CLEAR), (0, 0)).tolist() == [[3, 4]]


def test_a_straight_line_is_the_same_wherever_it_is_drawn() -> None:
    here, _ = straight(np.array([[0, 0]]), np.array([[7, -3]]))
    there, _ = straight(np.array([[-100, 40]]), np.array([[-93, 37]]))

    assert (there - here == (-100, 40)).all()
