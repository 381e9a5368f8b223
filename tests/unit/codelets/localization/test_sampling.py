"""Rejection, resampling, and moments of headings on the circle."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.geometry.se2 import mean_pose, wrap_angle
from cogmap.services.codelets.localization.sampling import (
    generator,
    rejection_mask,
    resample,
    spread,
)


def test_rejection_keeps_samples_by_their_likelihood() -> None:
    likelihoods = np.repeat([1.0, 0.5, 0.1], 20_000)
    kept = rejection_mask(np.log(likelihoods), generator("a test"))
    shares = kept.reshape(3, -1).mean(axis=1)

    assert shares == pytest.approx([1.0, 0.5, 0.1], abs=0.02)


def test_rejection_keeps_the_likeliest_where_all_are_unlikely() -> None:
    kept = rejection_mask(np.array([-1e300, -1e301]), generator("a test"))

    assert kept.tolist() == [True, False]


def test_means_and_spreads_of_headings_are_taken_on_the_circle() -> None:
    left_of_west = math.pi - 0.1
    right_of_west = -math.pi + 0.1
    poses = np.array([[0.0, 0.0, left_of_west], [2.0, 0.0, right_of_west]])

    mean = mean_pose(poses)
    assert abs(mean[2]) == pytest.approx(math.pi)
    assert spread(poses, mean) == pytest.approx([1.0, 0.0, 0.1])


def test_headings_are_wrapped_to_half_a_turn_to_either_side() -> None:
    wrapped = wrap_angle(np.array([3 * math.pi, -0.5, math.pi]))

    assert wrapped == pytest.approx([math.pi, -0.5, math.pi])


def _resampled(jitter: float) -> set[tuple[float, ...]]:
    kept = np.array([[1.0, 2.0], [3.0, 4.0]])
    drawn = resample(kept, 50, jitter, generator("a"))
    return {tuple(row) for row in drawn.tolist()}


def test_resampling_draws_from_those_kept_and_jitters_each() -> None:
    assert _resampled(jitter=0.0) == {(1.0, 2.0), (3.0, 4.0)}
    assert len(_resampled(jitter=0.1)) == 50
