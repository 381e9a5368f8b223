"""Figure 6: what is told of a loop that closes, and what the paper's rule can do for one."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.loop_closing.metrics import loop_metrics
from experiments.loop_closing.observer import Loop, Map, Replayed
from experiments.loop_closing.rule import close_laps
from experiments.loop_closing.run import CORNERS_M, METHODS, trajectory
from schemas.array import Array
from schemas.cognition import Replay
from services.sim.odometry import Noise

DECAY = 0.2


def _replayed(before: np.ndarray, after: np.ndarray, pairs: np.ndarray) -> Replayed:
    apart = [np.hypot(*(where[pairs[:, 0]] - where[pairs[:, 1]]).T) for where in (before, after)]
    told = Replay(
        cycle=1,
        replays=3,
        closed=["closure:1"],
        undone=[],
        stamps_ns=Array.of(np.arange(len(before))),
        positions_m=Array.of(before),
        shifts_m=Array.of(after - before),
        pairs=Array.of(pairs.astype(np.int32)),
        strength_changes=Array.of(np.exp(-DECAY * apart[1]) - np.exp(-DECAY * apart[0])),
        decay_per_m=DECAY,
    )
    return Replayed.of(told)


def _squeezed() -> Replayed:
    """A straight path of places 2.5 m apart, each step shortened by chance, and its ends brought
    together.
    """
    before = np.column_stack([np.arange(0.0, 100.0, 2.5), np.zeros(40)])
    after = before * (0.9, 1.0) + np.random.default_rng(0).normal(0.0, 0.05, before.shape)
    after[-1] = after[0]
    neighbours = np.column_stack([np.arange(39), np.arange(1, 40)])
    return _replayed(before, after, np.vstack([neighbours, [[0, 39]]]))


def _loop(error_m: float) -> Loop:
    there = np.zeros((5, 2))
    off = Map(
        there + np.array([error_m, 0.0]), there, there + np.array([0.0, error_m]), there, there
    )
    exact = Map(there, there, there, there, there)
    wheels_m = there + np.array([2 * error_m, 0.0])
    return Loop(off, exact, off, there, wheels_m, [_squeezed()])


def test_pairs_are_close_where_their_fields_are_before_and_after() -> None:
    replayed = _squeezed()

    assert replayed.close.tolist() == [True] * 38 + [False, False]
    assert replayed.nearer_m[-1] == pytest.approx(97.5)


def test_synapses_of_close_places_change_by_the_decay_times_the_shift() -> None:
    metrics = loop_metrics({method: _loop(3.0) for method in METHODS})
    expected = DECAY * np.exp(-DECAY * 2.375)

    assert metrics["strength_change_per_m_close_pairs"] == pytest.approx(expected, rel=0.05)
    assert metrics["strength_and_shift_correlation_close_pairs"] > 0.99
    assert metrics["strength_change_per_m_all_pairs"] < 0.02
    assert metrics["close_pairs"] == 38


def test_errors_are_measured_before_and_after_correction_and_in_the_end() -> None:
    metrics = loop_metrics({method: _loop(3.0) for method in METHODS})
    told = [
        metrics[f"{name}_error_{when}_m_positions"]
        for name in ("path", "object")
        for when in ("before", "after")
    ]

    assert told == pytest.approx([3.0, 0.0, 3.0, 0.0])
    assert metrics["end_error_in_the_end_m_heading"] == pytest.approx(3.0)
    assert metrics["path_error_wheels_alone_m"] == pytest.approx(6.0)
    assert metrics["path_error_fused_alone_m"] == 0.0


def test_where_only_distances_err_the_rule_leaves_a_brownian_bridge() -> None:
    distances = Noise(speed=0.05, turn=0.0, drift_rad_per_sqrt_m=0.0)
    square = ((0.0, 0.0), (50.0, 0.0), (50.0, 50.0), (0.0, 50.0), (0.0, 0.0))
    laps = close_laps(square, 1.0, distances, 400, seed=3)

    # Half of the whole variance on the mean before, a sixth of it after.
    assert np.mean(laps.after_m**2) / np.mean(laps.before_m**2) == pytest.approx(1 / 3, rel=0.15)
    assert laps.helped > 0.8


def test_where_headings_err_the_rule_hardly_helps() -> None:
    headings = Noise(speed=0.0, turn=0.03, drift_rad_per_sqrt_m=0.01)
    laps = close_laps(CORNERS_M, 5.0, headings, 400, seed=3)

    assert 0.8 < laps.ratio < 1.0
    assert laps.helped < 0.7


def test_without_noise_nothing_errs() -> None:
    laps = close_laps(
        CORNERS_M, 2.5, Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.0), 2, seed=3
    )

    assert laps.before_m == pytest.approx(0.0, abs=1e-9) and laps.after_m == pytest.approx(
        0.0, abs=1e-9
    )


def test_the_way_ends_on_the_street_where_it_began() -> None:
    line = trajectory()["line_m"]

    assert line[0] == line[-2] and line[-1][1] == line[0][1] and 0 < line[-1][0] < line[1][0]
