"""A walk through a room: by spikes, by samples, and by the exact posterior."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from cogmap.experiments.spiking.metrics import walk_metrics
from cogmap.experiments.spiking.network import SOUTH, WEST, Border
from cogmap.experiments.spiking.posterior import GridPosterior, binned, total_variation
from cogmap.experiments.spiking.recursion import (
    DRAWN,
    RULES,
    Correct,
    Measured,
    by_rejection,
    by_spikes,
    measured,
)
from cogmap.experiments.spiking.room import (
    REACH_M,
    SIDE_M,
    START_SD_M,
    STEP_M,
    step_covariance_m2,
    walk,
)

MIDDLE_M = np.array([2.5, 2.5])


@cache
def _measured(cycles: int) -> Measured:
    return measured(1, 30, cycles)


def test_the_exact_posterior_moves_and_widens_by_the_steps_covariance() -> None:
    covariance_m2 = np.array([[0.04, 0.01], [0.01, 0.09]])
    moved = GridPosterior.about(MIDDLE_M).moved(np.array([0.511, -0.237]), covariance_m2)
    mean_m, found_m2 = moved.moments()

    assert mean_m == pytest.approx((3.011, 2.263), abs=1e-6)
    assert found_m2 == pytest.approx(covariance_m2 + START_SD_M**2 * np.eye(2), abs=1e-6)


def test_the_exact_posterior_weighs_a_wall_by_its_precision() -> None:
    """2.5 +- 0.3 m by path integration, 2.8 +- 0.3 m by the wall."""
    prior = GridPosterior.about(MIDDLE_M).moved(np.zeros(2), (0.09 - START_SD_M**2) * np.eye(2))
    mean_m, covariance_m2 = prior.corrected(Border(SOUTH, 2.8, 0.3)).moments()

    assert mean_m == pytest.approx((2.5, 2.65), abs=1e-3)
    assert np.diag(covariance_m2) == pytest.approx((0.09, 0.045), rel=1e-3)


def test_distributions_that_share_nothing_are_at_a_distance_of_one() -> None:
    here = binned(np.full((10, 2), 1.1))
    half = binned(np.array([(1.1, 1.1)] * 5 + [(3.1, 1.1)] * 5))
    there = binned(np.full((10, 2), 3.9))

    assert total_variation(here, there) == 1.0
    assert total_variation(here, half) == 0.5
    assert total_variation(here, here) == 0.0


def test_samples_drawn_from_the_posterior_are_near_it() -> None:
    posterior = GridPosterior.about(MIDDLE_M).moved(np.zeros(2), 0.2 * np.eye(2))
    drawn_m = posterior.draw(100_000, np.random.default_rng(1))

    assert total_variation(posterior.binned(), binned(drawn_m)) < 0.02


def test_a_step_errs_by_its_shares_along_and_across() -> None:
    found_m2 = step_covariance_m2(np.array([0.0, 2.0]))

    assert found_m2 == pytest.approx(np.diag([0.3**2, 0.6**2]))


def test_walls_are_sensed_within_reach_alone() -> None:
    walked = walk(3, 200)
    wide_m = SIDE_M - REACH_M

    for (x_m, y_m), borders in zip(walked.true_m.tolist(), walked.borders, strict=True):
        axes = [border.axis for border in borders]
        assert (WEST in axes) == (x_m < REACH_M or x_m > wide_m)
        assert (SOUTH in axes) == (y_m < REACH_M or y_m > wide_m)
    assert np.hypot(*walked.moved_m.T) == pytest.approx(STEP_M)


@pytest.mark.parametrize("correct", [by_spikes, by_rejection])
def test_both_rules_give_the_posterior_of_two_walls(correct: Correct) -> None:
    """2.5 +- 0.3 m along x and y, walls at 2.8 +- 0.3 m and at 2.2 +- 0.4 m."""
    samples_m = np.random.default_rng(1).normal(MIDDLE_M, 0.3, (40_000, 2))
    walls = (Border(WEST, 2.8, 0.3), Border(SOUTH, 2.2, 0.4))
    found_m = correct(samples_m, walls, np.random.default_rng(2))

    assert found_m.mean(axis=0) == pytest.approx((2.65, 2.5 - 0.3 * 0.09 / 0.25), abs=0.02)
    assert found_m.std(axis=0) == pytest.approx((0.3 / 2**0.5, 0.24), rel=0.04)


def test_spikes_follow_the_exact_posterior_along_a_walk() -> None:
    metrics = walk_metrics([_measured(1500)])

    assert metrics["sd_ratio_spikes"] == pytest.approx(1.0, abs=0.1)
    assert metrics["total_variation_spikes"] < 0.15
    assert metrics["rmse_spikes_m"] < 1.2 * metrics["rmse_exact_m"] + 0.02


def test_more_cycles_bring_the_spikes_nearer_to_the_posterior() -> None:
    few = walk_metrics([_measured(200)])
    many = walk_metrics([_measured(1500)])

    assert many["total_variation_spikes"] < 0.7 * few["total_variation_spikes"]


def test_what_starts_from_its_mean_knows_of_the_last_step_alone() -> None:
    metrics = walk_metrics([_measured(1500)])

    assert metrics["sd_ratio_samples_from_mean"] < 0.6
    assert metrics["sd_ratio_spikes_from_mean"] < 0.6


def test_metrics_compare_every_rule_with_the_exact_posterior() -> None:
    metrics = walk_metrics([_measured(200)])

    for rule in (*RULES, DRAWN):
        assert 0 < metrics[f"total_variation_{rule}"] < 1
        assert metrics[f"rmse_{rule}_m"] > 0
    assert metrics["samples_drawn_from_exact"] == metrics["samples_spikes"]


def test_the_same_seed_gives_the_same_walk_and_spikes() -> None:
    first = measured(5, 10, 200)
    again = measured(5, 10, 200)

    assert np.array_equal(first.tracks["spikes"].mean_m, again.tracks["spikes"].mean_m)
    assert not np.array_equal(first.walk.true_m, walk(6, 10).true_m)
