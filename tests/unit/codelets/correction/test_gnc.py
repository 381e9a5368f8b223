"""Which closures are inliers, by graduated non-convexity."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.map_correction.false_groups import false_closures
from services.codelets.correction.gnc import inliers
from services.codelets.correction.least_squares import optimize
from tests.support.world.laps import CLOSURE_SD, error_m, laps, one_between

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


@pytest.mark.parametrize("seed", range(3))
def test_false_closures_that_agree_with_one_another_count_once(seed: int) -> None:
    measured = laps(seed=seed)
    own = measured.graph.closures
    false = false_closures(measured.graph, 10, 5, np.random.default_rng(seed))

    hold = inliers(measured.with_closures(own + false), FALSE_CLOSURE)
    assert not hold[len(own) :].any()
    assert hold[: len(own)].mean() > 0.9


@pytest.mark.parametrize(("error_x_m", "holds"), [(0.0, True), (60.0, False)])
def test_a_lone_closure_is_an_inlier_within_drift_and_an_outlier_beyond(
    error_x_m: float, holds: bool
) -> None:
    closure = one_between(0, 80, (error_x_m, 0.0, 0.0), CLOSURE_SD)
    graph = laps(2).with_closures(closure)

    assert inliers(graph, FALSE_CLOSURE).tolist() == [holds]
