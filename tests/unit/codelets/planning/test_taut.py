"""Routes drawn taut: straight where the ground is clear, and as they were elsewhere."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.services.codelets.planning.network import grid_network
from cogmap.services.codelets.planning.routes import cost_m
from cogmap.services.codelets.planning.taut import straight, taut

CLEAR = np.ones((40, 40), bool)


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
    line = taut(_bent(), (0, 0), CLEAR)

    assert _aside(_bent().astype(np.float64)) > 2.0
    assert _aside(line) < 0.02


def test_a_taut_route_leads_from_neighbour_to_neighbour() -> None:
    route = _cells(taut(_bent(), (0, 0), CLEAR))

    assert route[0].tolist() == [0, 10]
    assert route[-1].tolist() == [30, 20]
    assert np.abs(np.diff(route, axis=0)).max(axis=1).tolist() == [1] * (len(route) - 1)


def test_a_taut_route_is_no_longer_by_its_links() -> None:
    network = grid_network(CLEAR)

    route = _cells(taut(_bent(), (0, 0), CLEAR))

    assert cost_m(network, route) <= cost_m(network, _bent())


def _beside(wall: tuple[slice, slice]) -> Booleans:
    """Clear ground but for a wall."""
    is_clear = CLEAR.copy()
    is_clear[wall] = False
    return is_clear


def test_a_taut_route_leads_over_no_ground_that_is_not_clear() -> None:
    is_clear = _beside((slice(5, 25), slice(12, 14)))
    before = [(0, j) for j in range(5, 9)] + [(j - 8, j) for j in range(9, 13)]
    after = [(4, 13), (5, 14), *((i, 14) for i in range(6, 20))]
    route = _cells(taut(np.array(before + after), (0, 0), is_clear))

    assert is_clear[tuple(route.T)].all()
    assert route.tolist() != before + after


def test_a_taut_route_passes_diagonally_between_no_two_corners() -> None:
    is_clear = _beside((slice(11, 40), slice(0, 11)))
    bend = [(i, 10) for i in range(5, 11)] + [(10, 11), *((i, 11) for i in range(11, 16))]
    route = _cells(taut(np.array(bend), (0, 0), is_clear))

    i, j = route.T
    assert is_clear[i[1:], j[:-1]].all()
    assert is_clear[i[:-1], j[1:]].all()


def test_ground_that_is_not_clear_is_passed_as_the_route_was() -> None:
    route = taut(_bent(), (0, 0), ~CLEAR)

    assert route.tolist() == _bent().tolist()


def test_a_route_is_drawn_taut_wherever_its_ground_begins() -> None:
    origin = np.array([-7, 12])
    route = taut(_bent() + origin, (-7, 12), CLEAR)

    assert route.tolist() == (taut(_bent(), (0, 0), CLEAR) + origin).tolist()


def test_a_route_of_one_place_stays() -> None:
    assert taut(np.array([[3, 4]]), (0, 0), CLEAR).tolist() == [[3, 4]]


def test_a_straight_line_is_the_same_wherever_it_is_drawn() -> None:
    here = straight(np.array([0, 0]), np.array([7, -3]))
    there = straight(np.array([-100, 40]), np.array([-93, 37]))

    assert (there - here == (-100, 40)).all()
