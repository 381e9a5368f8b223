"""Figure 6: what is told of a loop that closes, and what the paper's rule can do for one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cogmap.estimation.pose_graph import Constraints, PoseGraph, diagonal_information
from cogmap.experiments.loop_closing.metrics import loop_metrics, solver_metrics
from cogmap.experiments.loop_closing.observer import Loop, Map
from cogmap.experiments.loop_closing.rule import close_laps
from cogmap.experiments.loop_closing.run import CORNERS_M, METHODS, trajectory
from cogmap.experiments.loop_closing.solvers import Solvers, solvers
from cogmap.experiments.predictions.replayed import Replayed
from cogmap.schemas.array import Array
from cogmap.schemas.cognition import Replay
from cogmap.services.sim.odometry import Noise
from tests.support.paths import distances_m

DECAY = 0.2


def _strength(positions_m: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """The strength of the synapse of each pair of places."""
    first, second = pairs.T
    apart_m = distances_m(positions_m[first], positions_m[second])
    return np.exp(-DECAY * apart_m)


def _replayed(before: np.ndarray, after: np.ndarray, pairs: np.ndarray) -> Replayed:
    changes = _strength(after, pairs) - _strength(before, pairs)
    replay = Replay(
        cycle=1,
        replays=3,
        closed=["closure:1"],
        undone=[],
        stamps_ns=Array.of(np.arange(len(before))),
        positions_m=Array.of(before),
        shifts_m=Array.of(after - before),
        pairs=Array.of(pairs.astype(np.int32)),
        strength_changes=Array.of(changes),
        decay_per_m=DECAY,
    )
    return Replayed.of(replay)


def _squeezed() -> Replayed:
    """A straight path of places 2.5 m apart, each step shortened by chance, and its ends brought
    together.
    """
    before = np.zeros((40, 2))
    before[:, 0] = np.arange(0.0, 100.0, 2.5)

    rng = np.random.default_rng(0)
    after = before * (0.9, 1.0) + rng.normal(0.0, 0.05, before.shape)
    after[-1] = after[0]

    numbers = np.arange(40)
    neighbours = np.column_stack([numbers[:-1], numbers[1:]])
    ends = [[0, 39]]
    return _replayed(before, after, np.vstack([neighbours, ends]))


def _loop(error_m: float) -> Loop:
    there = np.zeros((17, 2))
    ahead = there + np.array([error_m, 0.0])
    aside = there + np.array([0.0, error_m])
    wheels_m = there + np.array([2 * error_m, 0.0])

    off = Map(ahead, there, aside, there, there)
    exact = Map(there, there, there, there, there)
    return Loop(off, exact, off, _square(), there, wheels_m, [_squeezed()])


def _square() -> PoseGraph:
    """Once round a square of 10 m in steps of 2.5 m, each measured 0.1 m too far east, and the end
    seen to be where the start is.
    """
    ahead = np.repeat([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)], 4, axis=0)
    true_m = np.vstack([[0.0, 0.0], np.cumsum(2.5 * ahead, axis=0)])
    steps_m = np.diff(true_m, axis=0) + np.array([0.1, 0.0])
    poses = np.column_stack([true_m, np.zeros(17)])
    measured = np.column_stack([steps_m, np.zeros(16)])

    weak = diagonal_information(np.full(16, 1.0), np.full(16, 1e4))
    strong = diagonal_information(np.array([100.0]), np.array([1e4]))
    numbers = np.arange(16)
    steps = Constraints(numbers, numbers + 1, measured, weak)
    closure = Constraints(np.array([0]), np.array([16]), np.zeros((1, 3)), strong)
    return PoseGraph(poses, steps, closure)


def _metrics(error_m: float) -> dict[str, float]:
    """Of a loop that errs so much, by whichever method."""
    loops = {method: _loop(error_m) for method in METHODS}
    return loop_metrics(loops)


def test_pairs_are_close_where_their_fields_are_before_and_after() -> None:
    replayed = _squeezed()
    expected = [True] * 38 + [False, False]

    assert replayed.close.tolist() == expected
    assert replayed.nearer_m[-1] == pytest.approx(97.5)


def test_synapses_of_close_places_change_by_the_decay_times_the_shift() -> None:
    metrics = _metrics(3.0)
    expected = DECAY * np.exp(-DECAY * 2.375)

    assert metrics["strength_change_per_m_close_pairs"] == pytest.approx(expected, rel=0.05)
    assert metrics["strength_and_shift_correlation_close_pairs"] > 0.99
    assert metrics["strength_change_per_m_all_pairs"] < 0.02
    assert metrics["close_pairs"] == 38


def test_errors_are_measured_before_and_after_correction_and_in_the_end() -> None:
    metrics = _metrics(3.0)

    for name in ("path", "object"):
        assert metrics[f"{name}_error_before_m_positions"] == pytest.approx(3.0)
        assert metrics[f"{name}_error_after_m_positions"] == pytest.approx(0.0)
    assert metrics["end_error_in_the_end_m_heading"] == pytest.approx(3.0)
    assert metrics["path_error_wheels_alone_m"] == pytest.approx(6.0)
    assert metrics["path_error_fused_alone_m"] == 0.0
    assert "path_over_fused_heading" not in metrics


def test_the_path_is_compared_with_fused_self_motion_alone() -> None:
    drifting_m = np.zeros((17, 2)) + np.array([0.0, 12.0])
    loops = {method: replace(_loop(3.0), fused_path_m=drifting_m) for method in METHODS}

    metrics = loop_metrics(loops)

    assert metrics["path_error_fused_alone_m"] == pytest.approx(12.0)
    assert metrics["path_over_fused_heading"] == pytest.approx(0.25)


def test_where_only_distances_err_the_rule_leaves_a_brownian_bridge() -> None:
    distances = Noise(speed=0.05, turn=0.0, drift_rad_per_sqrt_m=0.0)
    square = ((0.0, 0.0), (50.0, 0.0), (50.0, 50.0), (0.0, 50.0), (0.0, 0.0))
    laps = close_laps(square, 1.0, distances, 400, seed=3)
    variance_ratio = np.mean(laps.after_m**2) / np.mean(laps.before_m**2)

    # Half of the whole variance on the mean before, a sixth of it after.
    assert variance_ratio == pytest.approx(1 / 3, rel=0.15)
    assert laps.helped > 0.8


def test_where_headings_err_the_rule_hardly_helps() -> None:
    headings = Noise(speed=0.0, turn=0.03, drift_rad_per_sqrt_m=0.01)
    laps = close_laps(CORNERS_M, 5.0, headings, 400, seed=3)

    assert 0.8 < laps.ratio < 1.0
    assert laps.helped < 0.7


def test_without_noise_nothing_errs() -> None:
    quiet = Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.0)
    laps = close_laps(CORNERS_M, 2.5, quiet, 2, seed=3)

    assert laps.before_m == pytest.approx(0.0, abs=1e-9)
    assert laps.after_m == pytest.approx(0.0, abs=1e-9)


def test_the_trajectory_ends_on_the_street_where_it_began() -> None:
    line = trajectory()["line_m"]
    start, corner = line[:2]
    back, end = line[-2:]
    end_x_m, end_y_m = end

    assert back == start
    assert end_y_m == start[1]
    assert 0 < end_x_m < corner[0]


@cache
def _solved() -> Solvers:
    return solvers(_loop(3.0))


def test_every_solver_begins_with_path_integration_and_none_passes_the_least() -> None:
    curves = _solved().curves

    for curve in curves.values():
        assert curve.from_solution_m[0] == pytest.approx(curves["eq9"].from_solution_m[0])
        assert curve.cost_over_least.min() >= 1 - 1e-9


def test_one_reverse_replay_solves_one_loop_and_gauss_seidel_takes_many() -> None:
    """Of equal steps, and a closure a hundred times as certain, the end moves by 1600 / 1601."""
    metrics = solver_metrics(_solved())

    assert (metrics["solved_places"], metrics["solved_closures"]) == (17, 1)
    assert metrics["reverse_replay_solved_after_passes"] == 1
    assert metrics["gauss_seidel_over_loops_solved_after_passes"] == 1
    assert metrics["reverse_replay_from_solution_after_1_passes_m"] == pytest.approx(0.0, abs=1e-9)
    assert metrics["gauss_seidel_solved_after_passes"] > 40
    assert metrics["gauss_seidel_from_solution_after_1000_passes_m"] == pytest.approx(0.0, abs=1e-6)


def test_eq_9_as_printed_halves_the_discrepancy_at_each_replay() -> None:
    left_m = _solved().curves["eq9"].from_solution_m

    # All of it, 1.6 m at the end: the printed shares begin one step late.
    assert left_m[1] / left_m[0] == pytest.approx(0.5, abs=0.05)
    assert left_m[2] / left_m[0] == pytest.approx(0.25, abs=0.06)
