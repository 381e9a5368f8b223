"""Place cells that fire where path integration and what is sensed coincide."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.estimation.spiking.cells import SPACINGS_M
from cogmap.estimation.spiking.coincidence import Tuning, fire, represented, spacings_m
from cogmap.geometry.arrays import Floats, Singles

CYCLES = 40_000
FACTOR = math.exp(-0.5)


def _cloud(*sds: float, middle: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Floats:
    """Samples of path integration, one a cycle."""
    return np.random.default_rng(1).normal(middle[: len(sds)], sds, (CYCLES, len(sds)))


def _sensed_x(sensed_m: float, sd_m: float) -> Tuning:
    """The tuning of a border cell of a wall along y."""

    def tuning(poses: Floats) -> Singles:
        deviations = (poses[None, :, 0] - sensed_m) / sd_m
        return np.exp(-(deviations**2) / 2).astype(np.float32)

    return tuning


def test_what_is_represented_has_the_spread_of_the_samples() -> None:
    samples = _cloud(0.4, 0.4, 0.05, middle=(300.0, -200.0, 3.1))
    poses = represented(samples, np.random.default_rng(2))

    assert poses.mean(axis=0) == pytest.approx((300.0, -200.0, 3.1), abs=0.02)
    assert poses.std(axis=0) == pytest.approx((0.4, 0.4, 0.05), rel=0.04)


def test_spikes_weigh_path_integration_and_a_border_by_precision() -> None:
    """0 +- 0.3 m and 0.3 +- 0.3 m: 0.15 +- 0.3 / sqrt(2) m; across, nothing is sensed."""
    spikes = fire(_cloud(0.3, 0.3), _sensed_x(0.3, 0.3), np.random.default_rng(2))

    assert spikes.mean(axis=0) == pytest.approx((0.15, 0.0), abs=0.02)
    assert spikes.std(axis=0) == pytest.approx((0.3 / 2**0.5, 0.3), rel=0.05)


def test_spikes_of_two_places_are_in_proportion_to_likelihood() -> None:
    """At 0 the border is where it is sensed, at 1 m one standard deviation off."""
    samples = np.repeat([(0.0, 0.0), (1.0, 0.0)], CYCLES // 2, axis=0)
    spikes = fire(samples, _sensed_x(0.0, 1.0), np.random.default_rng(2))
    is_far = spikes[:, 0] > 0.5

    assert is_far.mean() == pytest.approx(FACTOR / (1 + FACTOR), abs=0.02)


def test_headings_stay_with_their_positions() -> None:
    samples = _cloud(0.3, 0.3, 0.01)
    samples[:, 2] += samples[:, 0]
    spikes = fire(samples, _sensed_x(0.3, 0.3), np.random.default_rng(2))

    assert spikes[:, 2].mean() == pytest.approx(0.15, abs=0.02)
    assert np.corrcoef(spikes[:, 0], spikes[:, 2])[0, 1] > 0.95


def test_nothing_fires_for_what_fits_no_sample() -> None:
    spikes = fire(_cloud(0.1, 0.1), _sensed_x(5.0, 0.1), np.random.default_rng(2))

    assert not len(spikes)


def test_what_is_sensed_far_off_still_fires_the_likeliest_place() -> None:
    spikes = fire(_cloud(0.1, 0.1), _sensed_x(0.8, 0.2), np.random.default_rng(2))

    assert spikes[:, 0].mean() == pytest.approx(0.8 * 0.1**2 / (0.1**2 + 0.2**2), abs=0.02)


def test_modules_are_a_ladder_as_wide_as_what_is_possible() -> None:
    narrow = spacings_m(_cloud(0.5, 0.5))
    wide = spacings_m(_cloud(4.0, 0.5))

    assert narrow == pytest.approx(SPACINGS_M, rel=0.02)
    assert len(wide) > len(narrow)
    assert wide[-1] > 0.7 * 4 * 6


def test_samples_without_spread_are_represented_where_they_are() -> None:
    samples = np.tile((5.0, 3.0, 1.0), (400, 1))
    poses = represented(samples, np.random.default_rng(2))

    assert len(poses) > 100
    assert poses == pytest.approx(np.tile((5.0, 3.0, 1.0), (len(poses), 1)), abs=0.01)


def test_the_same_generator_gives_the_same_spikes() -> None:
    first, again = (
        fire(_cloud(0.2, 0.3), _sensed_x(0.1, 0.2), np.random.default_rng(7)) for _ in range(2)
    )

    assert np.array_equal(first, again)
