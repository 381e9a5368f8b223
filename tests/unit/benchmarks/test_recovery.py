"""When a robot counts as localized again after a part of its log was cut out."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.localization.recovery import recovery_of

SINCE_S = np.arange(0.0, 100.0)


def _errors_m(*over_s: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Small errors, but for those times."""
    errors_m = np.full(len(SINCE_S), 0.1)
    errors_m[list(over_s)] = 3.0
    return errors_m


def test_a_robot_that_was_never_lost_recovers_at_once() -> None:
    assert recovery_of(SINCE_S, _errors_m()) == (0.0, 0.0)


def test_it_has_recovered_once_its_error_stays_small_for_twenty_seconds() -> None:
    found = recovery_of(SINCE_S, _errors_m(0, 1, 2, 10))

    assert found.lost_s == 11.0


def test_one_excursion_long_after_counts_for_the_share_alone() -> None:
    found = recovery_of(SINCE_S, _errors_m(0, 1, 80))

    assert found.lost_s == 2.0
    assert found.over_share == pytest.approx(1 / 98)


def test_one_that_is_found_for_moments_only_was_lost_all_the_time() -> None:
    found = recovery_of(SINCE_S, _errors_m(*range(0, 100, 15)))

    assert found == (99.0, 1.0)
