"""Planners against exact search, on maps of several kinds that are drawn at random."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.sparse.csgraph import dijkstra

from cogmap.services.codelets.planning.activation import find_route
from cogmap.services.codelets.planning.network import PlaceNetwork, grid_network
from cogmap.services.codelets.planning.search.flat import FlatPlanner
from cogmap.services.codelets.planning.search.hierarchy import HierarchicalPlanner
from cogmap.services.codelets.planning.search.links import Links
from cogmap.services.codelets.planning.search.route import NoRoute, NoRouteReason, Route

SIDE = 48


def scattered(random, share=0.25):
    return random.random((SIDE, SIDE - 7)) >= share


def rooms(random):
    free = np.ones((SIDE, SIDE), bool)
    for wall in range(8, SIDE, 8):
        free[wall] = False
        free[:, wall] = False
    for wall in range(8, SIDE, 8):
        for room in range(0, SIDE, 8):
            free[wall, room + random.integers(1, 8)] = True
            free[room + random.integers(1, 8), wall] = True
    return free


def maze(random):
    """Corridors two cells wide between walls of one, by a walk that never returns to a room."""
    side = SIDE // 3
    free = np.zeros((3 * side + 1, 3 * side + 1), bool)
    seen = {(0, 0)}
    trail = [(0, 0)]
    free[1:3, 1:3] = True
    while trail:
        i, j = trail[-1]
        beside = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
        new = [(a, b) for a, b in beside if min(a, b) >= 0 and max(a, b) < side]
        new = [room for room in new if room not in seen]
        if not new:
            trail.pop()
            continue
        a, b = new[random.integers(len(new))]
        seen.add((a, b))
        trail.append((a, b))
        free[3 * min(a, i) + 1 : 3 * max(a, i) + 3, 3 * min(b, j) + 1 : 3 * max(b, j) + 3] = True
    return free


def weighted(random):
    """Scattered obstacles, on ground of which patches are slow."""
    network = grid_network(scattered(random, 0.15), cell_m=0.5, origin=(-30, 12))
    patches = random.choice([0.2, 0.5, 1], (SIDE // 6, SIDE // 6))
    _, width, height = network.weights.shape
    share = np.kron(patches, np.ones((6, 6)))[:width, :height]
    return network._replace(weights=(network.weights * share).astype(np.float32))


def any_network(kind, seed=3):
    random = np.random.default_rng(seed)
    made = kind(random)
    return made if isinstance(made, PlaceNetwork) else grid_network(made)


def pairs(network, count=60, seed=5):
    """Pairs of linked cells, and the cost of the cheapest route between them."""
    links = Links(network)
    nodes = np.flatnonzero(links.is_linked)
    random = np.random.default_rng(seed)
    graph = links.matrix().copy()
    graph.data[np.isinf(graph.data)] = 0
    graph.eliminate_zeros()

    for start, goal in random.choice(nodes, (count, 2)):
        if start != goal:
            (i, j), (a, b) = links.cells(np.array([start, goal])).tolist()
            yield (i, j), (a, b), dijkstra(graph, indices=goal)[start]


KINDS = pytest.mark.parametrize("kind", [scattered, rooms, maze, weighted])


def cost_along(network, cells):
    """The cost of a route, by the links that it takes; inf where one is cut."""
    links = Links(network)
    nodes = [links.node(cell) for cell in map(tuple, cells.tolist())]
    cost = 0.0
    for here, there in itertools.pairwise(nodes):
        (slot,) = np.flatnonzero(links.neighbours[here] == there)
        cost += links.costs_m[here, slot]
    return cost


@KINDS
def test_a_flat_route_is_as_cheap_as_the_cheapest(kind):
    network = any_network(kind)
    planner = FlatPlanner(network)

    for start, goal, cheapest in pairs(network):
        answer = planner.find_route(start, goal)
        if np.isinf(cheapest):
            assert answer == NoRoute(NoRouteReason.NOT_CONNECTED)
            continue

        assert isinstance(answer, Route)
        assert answer.cost_m == cheapest == cost_along(network, answer.cells)
        assert [answer.cells[0].tolist(), answer.cells[-1].tolist()] == [list(start), list(goal)]


@KINDS
def test_a_flat_route_is_the_one_that_activation_everywhere_leads_along(kind):
    network = any_network(kind)
    planner = FlatPlanner(network)

    for start, goal, cheapest in pairs(network, 12):
        if np.isfinite(cheapest):
            everywhere = find_route(network, start, goal)
            answer = planner.find_route(start, goal)
            assert answer.cells.tolist() == everywhere.cells.tolist()


@KINDS
def test_the_hierarchy_finds_a_route_exactly_where_there_is_one(kind):
    network = any_network(kind)
    planner = HierarchicalPlanner(network)

    excess = []
    for start, goal, cheapest in pairs(network):
        answer = planner.find_route(start, goal)
        if np.isinf(cheapest):
            assert answer == NoRoute(NoRouteReason.NOT_CONNECTED)
            continue

        assert isinstance(answer, Route)
        assert answer.cost_m == cost_along(network, answer.cells)
        excess.append(answer.cost_m / cheapest)

    assert min(excess) >= 1
    assert np.mean(excess) <= 1.05


@KINDS
def test_after_links_are_cut_and_opened_plans_are_those_of_a_new_planner(kind):
    network = any_network(kind)
    random = np.random.default_rng(8)
    is_other = random.random(network.weights.shape) < 0.03
    changed = np.where(is_other, 1 - network.weights, network.weights).astype(np.float32)
    other = network._replace(weights=changed)

    for planner_class in (FlatPlanner, HierarchicalPlanner):
        updated = planner_class(network)
        for start, goal, _ in pairs(network, 5):
            updated.find_route(start, goal)
        updated.update(other)
        new = planner_class(other)
        for start, goal, _ in pairs(other, 30):
            answer = updated.find_route(start, goal)
            expected = new.find_route(start, goal)
            assert type(answer) is type(expected)
            if isinstance(answer, Route):
                assert answer.cells.tolist() == expected.cells.tolist()


def test_weights_changed_in_place_are_taken_by_an_update():
    free = np.ones((20, 9), bool)
    network = grid_network(free)
    planner = HierarchicalPlanner(network)
    network.weights[:, 9:11] = 0
    planner.update(network)

    answer = planner.find_route((2, 2), (17, 2))

    assert answer == NoRoute(NoRouteReason.NOT_CONNECTED)


@pytest.mark.parametrize("planner_class", [FlatPlanner, HierarchicalPlanner])
def test_a_network_that_grew_is_planned_over(planner_class):
    planner = planner_class(grid_network(np.ones((10, 10), bool)))
    planner.update(grid_network(np.ones((30, 12), bool), origin=(-5, 0)))

    answer = planner.find_route((-5, 0), (24, 0))

    assert isinstance(answer, Route)
    assert answer.length_m == pytest.approx(29)


@pytest.mark.parametrize("planner_class", [FlatPlanner, HierarchicalPlanner])
def test_planners_state_why_there_is_no_route(planner_class):
    free = np.ones((12, 12), bool)
    free[5, 5] = False
    planner = planner_class(grid_network(free))

    reasons = {
        NoRouteReason.START_OUTSIDE: planner.find_route((0, 12), (1, 1)),
        NoRouteReason.GOAL_OUTSIDE: planner.find_route((1, 1), (-1, 0)),
        NoRouteReason.START_BLOCKED: planner.find_route((5, 5), (1, 1)),
        NoRouteReason.GOAL_BLOCKED: planner.find_route((1, 1), (5, 5)),
        NoRouteReason.AT_GOAL: planner.find_route((1, 1), (1, 1)),
    }

    for reason, answer in reasons.items():
        assert answer == NoRoute(reason)


@pytest.mark.parametrize("planner_class", [FlatPlanner, HierarchicalPlanner])
def test_ground_that_is_blocked_everywhere_may_be_opened(planner_class):
    free = np.zeros((10, 4), bool)
    planner = planner_class(grid_network(free))
    blocked = planner.find_route((0, 0), (9, 3))
    free[:, 2] = True
    planner.update(grid_network(free))

    opened = planner.find_route((0, 2), (9, 2))

    assert blocked == NoRoute(NoRouteReason.START_BLOCKED)
    assert isinstance(opened, Route)
    assert opened.length_m == 9
