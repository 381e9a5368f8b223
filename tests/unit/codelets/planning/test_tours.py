"""The order of several goals: on a hierarchy of grids, and on a flat one."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from cogmap.data.tsplib import straight
from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.planning.tours import (
    TourSettings,
    follow_activation,
    order,
    order_from,
    route_length,
)

DEFAULTS = TourSettings()
SIZES = (1, 2, 3, 4, 5, 8, 30, 81)


def _goals(number: int, seed: int = 0) -> Floats:
    rng = np.random.default_rng([seed, number])
    return rng.uniform(0.0, 100.0, (number, 2))


def _shortest(lengths: Floats, *, closed: bool) -> float:
    """By trying every order from the first goal."""
    others = range(1, len(lengths))
    found = []
    for rest in itertools.permutations(others):
        visited = np.array([0, *rest])
        found.append(route_length(lengths, visited, closed=closed))
    return min(found)


def _planned(positions_m: Floats, *, closed: bool, settings: TourSettings = DEFAULTS) -> Indices:
    plan = order if closed else order_from
    return plan(straight(positions_m), positions_m, settings)


@pytest.mark.parametrize("closed", [True, False], ids=["closed", "open"])
@pytest.mark.parametrize("number", SIZES)
def test_every_goal_is_visited_once_and_the_first_stays_first(number: int, closed: bool) -> None:
    visited = _planned(_goals(number), closed=closed)

    assert visited[0] == 0
    assert sorted(visited.tolist()) == list(range(number))


@pytest.mark.parametrize("closed", [True, False], ids=["closed", "open"])
@pytest.mark.parametrize("seed", range(5))
def test_as_many_goals_as_working_memory_holds_are_ordered_exactly(seed: int, closed: bool) -> None:
    positions_m = _goals(DEFAULTS.span + 1, seed)
    lengths = straight(positions_m)

    visited = _planned(positions_m, closed=closed)

    found = route_length(lengths, visited, closed=closed)
    assert found == pytest.approx(_shortest(lengths, closed=closed))


@pytest.mark.parametrize("closed", [True, False], ids=["closed", "open"])
def test_eight_goals_are_ordered_nearly_as_well_as_possible(closed: bool) -> None:
    ratios = []
    for seed in range(10):
        positions_m = _goals(8, seed)
        lengths = straight(positions_m)
        found = route_length(lengths, _planned(positions_m, closed=closed), closed=closed)
        ratios.append(found / _shortest(lengths, closed=closed))

    assert np.mean(ratios) < 1.02


def test_a_larger_working_memory_orders_eight_goals_exactly() -> None:
    positions_m = _goals(8)
    lengths = straight(positions_m)

    visited = _planned(positions_m, closed=True, settings=TourSettings(span=7))

    expected = _shortest(lengths, closed=True)
    assert route_length(lengths, visited, closed=True) == pytest.approx(expected)


def test_the_hierarchy_finds_shorter_tours_than_a_flat_grid() -> None:
    ratios = []
    for seed in range(8):
        positions_m = _goals(60, seed)
        lengths = straight(positions_m)
        hierarchical = route_length(lengths, _planned(positions_m, closed=True), closed=True)
        flat = route_length(lengths, follow_activation(lengths), closed=True)
        ratios.append(hierarchical / flat)

    assert np.mean(ratios) < 0.9


def test_on_a_flat_grid_the_nearest_goal_is_always_next() -> None:
    positions_m = np.array([[0.0, 0.0], [2.0, 0.0], [-1.0, 0.0], [5.0, 0.0]])

    assert follow_activation(straight(positions_m)).tolist() == [0, 2, 1, 3]


def test_of_goals_equally_near_the_first_is_next() -> None:
    positions_m = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])

    assert follow_activation(straight(positions_m)).tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize("factor", [1e-3, 1e6])
def test_the_order_does_not_depend_on_units_or_where_the_map_begins(factor: float) -> None:
    positions_m = _goals(40)
    elsewhere = factor * positions_m + 7.0

    assert np.array_equal(_planned(positions_m, closed=True), _planned(elsewhere, closed=True))


def test_a_turned_map_has_tours_about_as_short() -> None:
    positions_m = _goals(50)
    lengths = straight(positions_m)
    found = []
    for angle_rad in np.linspace(0.0, np.pi, 7):
        axis = np.array([np.cos(angle_rad), np.sin(angle_rad)])
        turned = positions_m @ np.array([axis, [-axis[1], axis[0]]])
        found.append(route_length(lengths, order(lengths, turned, DEFAULTS), closed=True))

    assert max(found) < 1.15 * min(found)


def test_the_same_goals_have_the_same_order_and_ties_do_not_matter() -> None:
    side = np.arange(6.0)
    grid = np.array(list(itertools.product(side, side)))
    lengths = straight(grid)

    orders = [order(lengths, grid, DEFAULTS).tolist() for _ in range(3)]
    nudged = order(lengths * (1 + 1e-15), grid, DEFAULTS).tolist()

    assert orders == [orders[0]] * 3
    assert nudged == orders[0]


def test_the_end_of_an_open_route_is_free() -> None:
    positions_m = np.column_stack([[0.0, 3.0, 1.0, 2.0, 4.0], np.zeros(5)])

    assert _planned(positions_m, closed=False).tolist() == [0, 2, 3, 1, 4]


def test_lengths_along_streets_count_not_straight_distances() -> None:
    """A wall between goals 1 and 2, which stand side by side."""
    positions_m = np.array([[0.0, 0.0], [10.0, 1.0], [10.0, -1.0], [20.0, 1.0], [20.0, -1.0]])
    lengths = straight(positions_m)
    lengths[1, 2] = lengths[2, 1] = 100.0

    visited = order_from(lengths, positions_m, DEFAULTS).tolist()

    assert abs(visited.index(1) - visited.index(2)) > 1
    assert route_length(lengths, np.array(visited), closed=False) == pytest.approx(
        _shortest(lengths, closed=False)
    )


def test_goals_at_one_place_are_all_visited() -> None:
    positions_m = np.repeat([[3.0, 4.0], [5.0, 6.0]], 6, axis=0)

    visited = _planned(positions_m, closed=True)

    assert sorted(visited.tolist()) == list(range(12))
    assert route_length(straight(positions_m), visited, closed=True) == pytest.approx(32**0.5)


@pytest.mark.parametrize(
    "lengths",
    [np.full((3, 3), np.inf), np.zeros((2, 3)), np.array([[0.0, 1.0], [2.0, 0.0]])],
    ids=["unreachable", "not square", "not symmetric"],
)
def test_lengths_that_no_tour_has_are_refused(lengths: Floats) -> None:
    with pytest.raises(CogmapError, match="cannot be reached"):
        order(lengths, np.zeros((len(lengths), 2)), DEFAULTS)
