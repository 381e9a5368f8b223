"""Which closures are inliers, by graduated non-convexity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.map_correction.false_groups import false_closures
from cogmap.estimation.gnc import inliers
from cogmap.estimation.hypotheses import Hypotheses
from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import Constraints, PoseGraph
from cogmap.geometry.arrays import Booleans
from cogmap.geometry.se2 import relative
from tests.support.world.laps import (
    CLOSURE_SD,
    LAP,
    Laps,
    between,
    error_m,
    laps,
    one_between,
)

FALSE_CLOSURE = 1e-3


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("false", [0, 1, 5, 12])
@pytest.mark.parametrize("headings", [True, False])
def test_false_closures_are_outliers_and_true_ones_inliers(
    seed: int, false: int, headings: bool
) -> None:
    measured = laps(seed=seed, false=false)
    closures = measured.graph.closures
    if not headings:
        closures.information[:, 2, :] = 0.0

    hold = inliers(measured.graph, FALSE_CLOSURE)
    assert not hold[~measured.is_true].any()
    assert hold[measured.is_true].mean() > 0.9

    kept = optimize(measured.with_closures(closures.select(hold)))
    best = optimize(measured.with_closures(closures.select(measured.is_true)))
    assert error_m(kept, measured.truth) < 1.2 * error_m(best, measured.truth) + 0.05


def _judged(measured: Laps, false: Constraints) -> tuple[Booleans, Booleans]:
    """Which of the true closures hold and which of the false ones, in the order of their ends."""
    closures = measured.graph.closures + false
    order = np.lexsort((closures.i, closures.j))
    in_order = measured.with_closures(closures.select(order))

    holds = np.zeros(len(closures), bool)
    holds[order] = inliers(in_order, FALSE_CLOSURE)
    true, of_false = np.split(holds, [len(measured.graph.closures)])
    return true, of_false


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("count", [10, 50])
def test_false_closures_that_agree_with_one_another_are_outliers_together(
    seed: int, count: int
) -> None:
    measured = laps(seed=seed)
    false = false_closures(measured.graph, count, 5, np.random.default_rng(seed))

    true, of_false = _judged(measured, false)
    assert not of_false.any()
    assert true.all()


def _agreeing(error_y_m: float) -> Constraints:
    """Three closures from a side of the square to the same two laps later, off alike."""
    first = np.array([5, 6, 7])
    measured = np.tile([0.0, error_y_m, 0.0], (3, 1))
    return between(first, first + 2 * LAP, measured, CLOSURE_SD)


def _understated(measured: Laps, false: Constraints) -> tuple[Laps, Constraints]:
    """The same with standard deviations that are stated five times too large."""
    graph = measured.graph
    stated = PoseGraph(
        poses=graph.poses,
        steps=_wider(graph.steps),
        closures=_wider(graph.closures),
    )
    return replace(measured, graph=stated), _wider(false)


def _wider(constraints: Constraints) -> Constraints:
    return constraints.weighted(np.full(len(constraints), 1 / 25))


@pytest.mark.parametrize("seed", range(3))
def test_a_path_that_fits_better_than_stated_forgives_closures_less(seed: int) -> None:
    many, false = _understated(laps(6, seed), _agreeing(4.0))
    true, of_false = _judged(many, false)

    assert not of_false.any()
    assert true.all()


@pytest.mark.parametrize("seed", [2, 5])
def test_where_most_closures_are_false_those_hold_that_state_one_thing(seed: int) -> None:
    measured = laps(2, seed)
    rng = np.random.default_rng([seed, 30])
    first = np.arange(12)
    street = between(first, first + LAP, rng.normal(0.0, 1.0, (12, 3)) * CLOSURE_SD, CLOSURE_SD)
    uncertain = measured.graph.steps.weighted(np.full(len(measured.graph.steps), 1 / 16))
    graph = PoseGraph(measured.graph.poses, uncertain, street)

    true, of_false = _judged(replace(measured, graph=graph), false_closures(graph, 30, 3, rng))
    assert true.all()
    assert not of_false.any()


def _exact(measured: Laps) -> Laps:
    """The same without noise in its steps and closures."""
    graph = measured.graph
    steps = replace(graph.steps, measurement=relative(measured.truth[:-1], measured.truth[1:]))
    closures = replace(graph.closures, measurement=np.zeros_like(graph.closures.measurement))
    return replace(measured, graph=PoseGraph(measured.truth, steps, closures))


def test_what_most_closures_state_is_believed_first_where_nothing_is_yet() -> None:
    exact = _exact(laps(2))
    few = np.array([5, 6, 7])
    mistaken = between(few, few + LAP, np.tile([3.0, 0.0, 0.0], (3, 1)), CLOSURE_SD)
    many = np.arange(20, 32)
    street = between(many, many + LAP, np.zeros((12, 3)), CLOSURE_SD)

    hypotheses = Hypotheses(exact.with_closures(mistaken + street), FALSE_CLOSURE)
    holds = hypotheses.settled(np.zeros(15, bool))
    assert holds.tolist() == [False] * 3 + [True] * 12

    alone = Hypotheses(exact.with_closures(mistaken), FALSE_CLOSURE)
    assert alone.settled(np.zeros(3, bool)).all()


def test_closures_along_one_street_do_not_tell_how_far_the_path_drifts_elsewhere() -> None:
    exact = _exact(laps(2))
    first = np.arange(30)
    street = between(first, first + LAP, np.zeros((30, 3)), CLOSURE_SD)
    later = one_between(70, 150, (2.0, 2.0, 0.0), CLOSURE_SD)

    assert inliers(exact.with_closures(street + later), FALSE_CLOSURE).all()


def test_a_path_without_noise_forgives_small_errors_as_it_is_stated_to_have() -> None:
    exact = _exact(laps(6))
    off = one_between(70, 150, (0.1, 0.1, 0.0), CLOSURE_SD)
    closures = exact.graph.closures + off

    assert inliers(exact.with_closures(closures), FALSE_CLOSURE).all()


@pytest.mark.parametrize(("error_x_m", "holds"), [(0.0, True), (60.0, False)])
def test_a_lone_closure_is_an_inlier_within_drift_and_an_outlier_beyond(
    error_x_m: float, holds: bool
) -> None:
    closure = one_between(0, 80, (error_x_m, 0.0, 0.0), CLOSURE_SD)
    graph = laps(2).with_closures(closure)

    assert inliers(graph, FALSE_CLOSURE).tolist() == [holds]
