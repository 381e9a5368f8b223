"""Routes by spreading activation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from cogmap.geometry.arrays import Booleans, Indices
from cogmap.graph.window import LINK_OFFSETS
from cogmap.services.codelets.planning.activation import Field, spread
from cogmap.services.codelets.planning.network import (
    Cell,
    PlaceNetwork,
    grid_network,
    place_network,
)


def _open_grid(origin: Cell = (0, 0), cell_m: float = 1.0) -> PlaceNetwork:
    return grid_network(np.ones((6, 5), bool), cell_m, origin)


def _wall(gap: int | None = None) -> Booleans:
    free = np.ones((7, 6), bool)
    free[3] = False
    if gap is not None:
        free[3, gap] = True
    return free


def _route(network: PlaceNetwork, start: Cell, goal: Cell) -> Indices:
    return _climbed(spread(network, np.array([goal])), start)


def test_distance_is_octile_on_a_free_grid() -> None:
    field = spread(_open_grid(), np.array([[0, 0]]))

    assert field.distance_m[3, 1] == pytest.approx(2 + np.sqrt(2), abs=1e-5)
    assert field.activation[0, 0] == 1


def test_the_nearest_of_several_goals_is_what_a_node_is_activated_by() -> None:
    field = spread(_open_grid(), np.array([[0, 0], [5, 4]]))

    assert field.distance_m[4, 4] == pytest.approx(1)


def test_a_route_leads_through_the_gap_of_a_wall_without_cutting_its_corners() -> None:
    network = grid_network(_wall(gap=5))
    route = _route(network, (2, 4), (4, 4))

    assert route.tolist() == [[2, 4], [2, 5], [3, 5], [4, 5], [4, 4]]
    assert network.cost_m(route) == pytest.approx(4)


def test_a_dear_place_is_avoided() -> None:
    cost = np.ones((6, 5))
    cost[2, 0] = 10.0

    assert [2, 0] not in _route(place_network(cost), (0, 0), (4, 0)).tolist()


def test_a_blocked_place_is_crossed_at_no_cost() -> None:
    cost = np.ones((6, 5))
    cost[2] = np.inf

    assert spread(place_network(cost), np.array([[0, 0]])).climb((4, 0)) is None


def test_cells_are_those_of_the_map_wherever_the_network_begins() -> None:
    route = _route(_open_grid((-10, 20), 0.5), (-10, 20), (-7, 20))

    assert route.tolist() == [[-10, 20], [-9, 20], [-8, 20], [-7, 20]]


def test_links_that_lead_out_of_the_network_are_ignored() -> None:
    network = _open_grid()
    network.weights[:] = 1
    field = spread(network, np.array([[0, 4]]))

    assert field.distance_m[5, 0] == pytest.approx(1 + 4 * np.sqrt(2), abs=1e-5)


@pytest.mark.parametrize("start", [(5, 5), (3, 2), (-1, 0)], ids=["behind", "blocked", "outside"])
def test_no_activation_arrives_behind_a_wall_on_it_or_outside(start: Cell) -> None:
    field = spread(grid_network(_wall()), np.array([[0, 0]]))

    assert not field.arrives(start)
    assert field.climb(start) is None


def test_the_agent_is_at_a_goal_that_has_no_links() -> None:
    free = np.zeros((3, 3), bool)
    free[1, 1] = True

    assert _route(grid_network(free), (1, 1), (1, 1)).tolist() == [[1, 1]]


@pytest.mark.parametrize("gap", [0, 5], ids=["after a long way round", "at once"])
def test_activation_that_spreads_until_it_reaches_the_agent_makes_the_same_route(gap: int) -> None:
    free = np.ones((7, 60), bool)
    free[3] = False
    free[3, 10 * gap] = True
    network = grid_network(free)
    start = (2, 50)
    goal = np.array([[4, 50]])

    whole = spread(network, goal)
    until = spread(network, goal, until=start)

    assert until.distance_m[start] == whole.distance_m[start]
    assert network.cost_m(_climbed(until, start)) == network.cost_m(_climbed(whole, start))


def test_activation_that_has_reached_the_agent_spreads_no_farther() -> None:
    field = spread(grid_network(np.ones((60, 5), bool)), np.array([[0, 2]]), until=(4, 2))

    assert field.arrives((4, 2))
    assert not field.arrives((50, 2))


def _climbed(field: Field, start: Cell) -> Indices:
    route = field.climb(start)
    assert route is not None
    return route


@pytest.mark.parametrize("seed", range(5))
def test_routes_cost_as_little_as_those_of_exact_search(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cost = np.where(rng.random((20, 15)) < 0.25, np.inf, rng.choice([1.0, 2.0, 10.0], (20, 15)))
    network = place_network(cost)
    field = spread(network, np.array([[3, 3]]))

    expected = dijkstra(_matrix(cost), indices=3 * 15 + 3).reshape(20, 15)
    np.testing.assert_allclose(field.distance_m, expected, rtol=1e-5)
    for start in np.argwhere(np.isfinite(expected)).tolist():
        route = field.climb((start[0], start[1]))
        assert route is not None
        assert network.cost_m(route) == pytest.approx(expected[tuple(start)], rel=1e-5)


def _matrix(cost: np.ndarray) -> sparse.csr_matrix:
    """The links of places, made one by one."""
    width, height = cost.shape
    links = sparse.lil_matrix((cost.size, cost.size))
    for i, j in np.argwhere(np.isfinite(cost)).tolist():
        for di, dj in [*LINK_OFFSETS.tolist(), *(-LINK_OFFSETS).tolist()]:
            if not (0 <= i + di < width and 0 <= j + dj < height):
                continue
            dearer = max(cost[i, j], cost[i + di, j + dj])
            if np.isfinite([dearer, cost[i + di, j], cost[i, j + dj]]).all():
                at = (i * height + j, (i + di) * height + j + dj)
                links[at] = math.hypot(di, dj) * dearer
    return links.tocsr()


def _corners(first_east: float) -> PlaceNetwork:
    """Four places in a square: from (0, 0) a link of this weight leads to (1, 0), from where the
    goal (1, 1) costs 1 m, and others of 2 m each lead over (0, 1). There is no diagonal.
    """
    weights = np.zeros((len(LINK_OFFSETS), 2, 2), np.float32)
    east, _, north, _ = weights
    east[0, 0] = first_east
    north[1, 0] = 1.0
    north[0, 0] = 0.5
    east[0, 1] = 0.5
    return PlaceNetwork((0, 0), 1.0, weights)


def test_a_route_can_follow_the_neighbour_with_the_highest_activation() -> None:
    field = spread(_corners(0.1), np.array([[1, 1]]))
    highest = field.ascend((0, 0))
    passed_most_on = field.climb((0, 0))

    assert field.log_activation.tolist() == [[-8.0, -4.0], [-2.0, 0.0]]
    assert highest is not None
    assert passed_most_on is not None
    assert highest.tolist() == [[0, 0], [1, 0], [1, 1]]
    assert passed_most_on.tolist() == [[0, 0], [0, 1], [1, 1]]


def test_no_route_rises_over_a_link_that_is_cut() -> None:
    field = spread(_corners(0.0), np.array([[1, 1]]))
    highest = field.ascend((0, 0))

    assert highest is not None
    assert highest.tolist() == [[0, 0], [0, 1], [1, 1]]


def test_no_route_rises_where_no_activation_arrives() -> None:
    field = spread(grid_network(_wall()), np.array([[6, 0]]))

    assert field.ascend((0, 0)) is None
