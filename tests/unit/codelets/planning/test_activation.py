"""Routes by spreading activation."""

import numpy as np
import pytest

from cogmap.services.codelets.planning.activation import (
    NoRoute,
    NoRouteReason,
    Route,
    climb,
    find_route,
    spread,
)
from cogmap.services.codelets.planning.network import grid_network


def open_grid(width=6, height=5, **settings):
    return grid_network(np.ones((width, height), bool), **settings)


def with_wall(column=3, gap=None):
    free = np.ones((7, 6), bool)
    free[column] = False
    if gap is not None:
        free[column, gap] = True
    return free


def test_distance_is_octile_on_a_free_grid():
    field = spread(open_grid(), np.array([[0, 0]]))

    assert field.distance_m[3, 1] == pytest.approx(2 + np.sqrt(2), abs=1e-5)
    assert field.activation[0, 0] == 1


def test_the_nearest_of_several_goals_is_what_a_node_is_activated_by():
    field = spread(open_grid(), np.array([[0, 0], [5, 4]]))

    assert field.distance_m[4, 4] == pytest.approx(1)


def test_a_route_leads_through_the_gap_of_a_wall_without_cutting_its_corners():
    network = grid_network(with_wall(gap=5))

    route = find_route(network, (2, 4), (4, 4))

    assert isinstance(route, Route)
    assert route.cells.tolist() == [[2, 4], [2, 5], [3, 5], [4, 5], [4, 4]]
    assert route.length_m == pytest.approx(4)


def test_a_link_of_low_weight_is_avoided():
    network = open_grid()
    network.weights[:, 2, 0] = 0.1

    route = find_route(network, (0, 0), (4, 0))

    assert isinstance(route, Route)
    assert [2, 0] not in route.cells.tolist()


def test_cells_are_those_of_the_map_wherever_the_network_begins():
    network = open_grid(origin=(-10, 20), cell_m=0.5)

    route = find_route(network, (-10, 20), (-7, 20))

    assert isinstance(route, Route)
    assert route.cells.tolist() == [[-10, 20], [-9, 20], [-8, 20], [-7, 20]]
    assert route.length_m == pytest.approx(1.5)


def test_links_that_lead_out_of_the_network_are_ignored():
    network = open_grid()
    network.weights[:] = 1

    route = find_route(network, (5, 0), (0, 4))

    assert isinstance(route, Route)
    assert route.length_m == pytest.approx(1 + 4 * np.sqrt(2), abs=1e-5)


def test_no_activation_arrives_behind_a_wall_so_there_is_no_climb():
    network = grid_network(with_wall())
    field = spread(network, np.array([[0, 0]]))

    assert climb(network, field, (5, 5)) is None


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        ((-1, 0), (0, 0), NoRouteReason.START_OUTSIDE),
        ((0, 0), (7, 0), NoRouteReason.GOAL_OUTSIDE),
        ((3, 2), (0, 0), NoRouteReason.START_BLOCKED),
        ((0, 0), (3, 2), NoRouteReason.GOAL_BLOCKED),
        ((1, 1), (1, 1), NoRouteReason.AT_GOAL),
        ((1, 1), (5, 1), NoRouteReason.NOT_CONNECTED),
    ],
)
def test_why_there_is_no_route_is_stated(start, goal, reason):
    network = grid_network(with_wall())

    assert find_route(network, start, goal) == NoRoute(reason)
