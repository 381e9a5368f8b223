"""The pure core of map correction: eq. 9 for many loops, headings too, one more closure, false
closures.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.map_correction.reference import best_positions
from cogmap.errors import MessageError
from services.codelets.correction import incremental
from services.codelets.correction.gnc import inliers
from services.codelets.correction.incremental import IncrementalSolver
from services.codelets.correction.least_squares import optimize
from services.codelets.correction.pose_graph import (
    Constraints,
    PoseGraph,
    cost,
    jacobians,
    residuals,
    sqrt_information,
)
from services.codelets.correction.reverse_replay import (
    Loops,
    close_loops,
    displacements,
    position_cost,
)

SIDE = 20
STEP_SD = np.array([0.05, 0.05, 0.01])
CLOSURE_SD = np.array([0.3, 0.3, 0.05])


def _between(
    first: np.ndarray, second: np.ndarray, measured: np.ndarray, sd: np.ndarray
) -> Constraints:
    return Constraints(first, second, measured, np.tile(np.diag(sd**-2.0), (len(first), 1, 1)))


def _followed(start: np.ndarray, steps: np.ndarray) -> np.ndarray:
    poses = [start]
    for forwards, left, turn in steps:
        x, y, heading = poses[-1]
        cos = np.cos(heading)
        sin = np.sin(heading)
        poses.append(
            np.array(
                [x + cos * forwards - sin * left, y + sin * forwards + cos * left, heading + turn]
            )
        )
    return np.array(poses)


def _laps(laps: int = 3, seed: int = 0, false: int = 0) -> tuple[np.ndarray, PoseGraph, np.ndarray]:
    """Laps round a square, integrated with noise: true poses, the graph, and which of its closures
    are true.
    """
    rng = np.random.default_rng(seed)
    side = [(1.0, 0.0, 0.0)] * (SIDE - 1) + [(1.0, 0.0, np.pi / 2)]
    exact = np.array(side * 4 * laps)
    truth = _followed(np.zeros(3), exact)
    noisy = exact + rng.normal(0.0, 1.0, exact.shape) * STEP_SD
    lap = 4 * SIDE
    at = np.arange(len(exact))
    ends = [(first, first + lap) for first in range(0, len(truth) - lap, 9)]
    while false:
        first, second = np.sort(rng.integers(0, len(truth), 2)).tolist()
        if second - first > SIDE and np.hypot(*(truth[first] - truth[second])[:2]) > 5:
            ends.append((first, second))
            false -= 1
    first, second = np.array(ends).T
    true = (second - first) % lap == 0
    measured = rng.normal(0.0, 1.0, (len(ends), 3)) * CLOSURE_SD
    closures = _between(first, second, measured, CLOSURE_SD)
    return (
        truth,
        PoseGraph(_followed(np.zeros(3), noisy), _between(at, at + 1, noisy, STEP_SD), closures),
        true,
    )


def _error_m(poses: np.ndarray, truth: np.ndarray) -> float:
    """The root mean square distance of the positions; both paths begin at one pose."""
    return float(np.sqrt(((poses - truth)[:, :2] ** 2).sum(axis=1).mean()))


def test_eq_9_shifts_each_place_by_the_share_of_variance_before_it() -> None:
    straight = _followed(np.zeros(3), np.array([(1.0, 0.0, 0.0)] * 10))
    at = np.arange(10)
    sd = np.ones(3)
    steps = _between(at, at + 1, np.array([(1.0, 0.0, 0.0)] * 10), sd)
    certain = _between(
        np.array([0]), np.array([8]), np.array([[6.0, 4.0, 0.0]]), np.array([1e-4, 1e-4, 1.0])
    )
    found = close_loops(PoseGraph(straight, steps, certain))
    share = np.minimum(np.arange(11), 8) / 8

    assert found.positions_m - straight[:, :2] == pytest.approx(
        share[:, None] * [-2.0, 4.0], abs=1e-6
    )
    assert found.replays == 1


def test_an_uncertain_closure_moves_the_path_by_its_share_of_precision() -> None:
    at = np.arange(4)
    straight = _followed(np.zeros(3), np.array([(1.0, 0.0, 0.0)] * 4))
    steps = _between(at, at + 1, np.array([(1.0, 0.0, 0.0)] * 4), np.ones(3))
    closure = _between(
        np.array([0]), np.array([4]), np.array([[0.0, 0.0, 0.0]]), np.array([2.0, 2.0, 1.0])
    )
    found = close_loops(PoseGraph(straight, steps, closure), tolerance=1e-9)

    assert found.positions_m[-1] == pytest.approx([4.0 - 4.0 * 4 / (4 + 4), 0.0])


@pytest.mark.parametrize("seed", range(3))
def test_replays_of_overlapping_loops_converge_to_least_squares(seed: int) -> None:
    _, graph, _ = _laps(seed=seed, false=2)
    exact = best_positions(graph)
    known = displacements(graph.poses, graph.constraints)
    least = position_cost(exact, graph.constraints, known)
    loose, close = (close_loops(graph, tolerance) for tolerance in (0.05, 1e-9))

    assert (
        least * 0.999999
        <= position_cost(loose.positions_m, graph.constraints, known)
        <= 1.05 * least
    )
    assert close.positions_m == pytest.approx(exact, abs=1e-2)
    assert loose.replays < close.replays


def test_the_costs_that_end_replay_are_eq_7_and_a_lower_bound_of_it() -> None:
    _, graph, _ = _laps()
    loops = Loops(graph)
    known = displacements(graph.poses, graph.constraints)
    least = position_cost(best_positions(graph), graph.constraints, known)
    forces = np.random.default_rng(0).normal(0.0, 0.1, (len(graph.closures), 2))
    total, bound = loops.costs(forces)

    assert total == pytest.approx(
        position_cost(loops.positions_m(forces), graph.constraints, known)
    )
    assert bound < least < total


def test_a_closure_measured_backwards_is_the_same_closure() -> None:
    _, graph, _ = _laps()
    headings = graph.poses[:, 2]
    ends = graph.closures
    here = displacements(graph.poses, ends)
    turned = Constraints(ends.j, ends.i, np.zeros((len(ends), 3)), ends.information)
    cos = np.cos(headings[ends.j])
    sin = np.sin(headings[ends.j])
    off = -here.offset_m
    turned.measurement[:, 0] = cos * off[:, 0] + sin * off[:, 1]
    turned.measurement[:, 1] = cos * off[:, 1] - sin * off[:, 0]
    backwards = close_loops(PoseGraph(graph.poses, graph.steps, turned), 1e-6)

    assert backwards.positions_m == pytest.approx(close_loops(graph, 1e-6).positions_m, abs=1e-2)


def test_reverse_replay_keeps_headings_and_the_first_position() -> None:
    _, graph, _ = _laps()
    assert close_loops(graph).positions_m[0] == pytest.approx(graph.poses[0, :2])

    alone = PoseGraph(graph.poses, graph.steps, graph.closures.select(slice(0, 0)))
    assert close_loops(alone).positions_m == pytest.approx(graph.poses[:, :2])
    assert optimize(alone) == pytest.approx(graph.poses)


def test_a_path_that_lacks_a_step_is_refused() -> None:
    _, graph, _ = _laps()
    missing = graph.constraints.select(np.arange(len(graph.constraints)) != 7)

    with pytest.raises(MessageError, match="from pose 7 to the next"):
        PoseGraph.of(graph.poses, missing)


def test_the_jacobians_are_those_of_finite_differences() -> None:
    _, graph, _ = _laps()
    loops = graph.closures
    by_first, by_second = jacobians(graph.poses, loops)
    for index in (0, 5):
        for by_end, end in ((by_first, loops.i), (by_second, loops.j)):
            for axis in range(3):
                there = graph.poses.copy()
                back = graph.poses.copy()
                there[end[index], axis] += 1e-6
                back[end[index], axis] -= 1e-6
                slope = (residuals(there, loops) - residuals(back, loops))[index] / 2e-6
                assert by_end[index][:, axis] == pytest.approx(slope, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_optimizing_headings_comes_nearer_to_the_truth_at_a_minimum(seed: int) -> None:
    truth, graph, _ = _laps(seed=seed)
    poses = optimize(graph)

    assert _error_m(poses, truth) < 0.5 * _error_m(graph.poses, truth)

    least = cost(poses, graph.constraints)
    rng = np.random.default_rng(seed)
    for _ in range(20):
        nudged = poses + rng.normal(0.0, 1e-3, poses.shape)
        nudged[0] = poses[0]
        assert cost(nudged, graph.constraints) > least


def test_one_more_closure_is_taken_in_as_if_all_had_been_solved_together() -> None:
    _, graph, _ = _laps()
    apart = graph.closures.select(np.arange(len(graph.closures)) % 3 == 0)
    before = graph.closures.select(np.arange(len(graph.closures)) % 3 != 0)
    solved = IncrementalSolver(PoseGraph(graph.poses, graph.steps, before))
    for index in range(len(apart)):
        poses = solved.add(apart.select(np.array([index])))
    together = optimize(PoseGraph(graph.poses, graph.steps, before + apart))

    assert cost(poses, graph.constraints) <= 1.01 * cost(together, graph.constraints)

    solved.relinearize()
    assert solved.graph.poses == pytest.approx(together, abs=2e-2)


def test_a_closure_that_turns_the_path_far_is_optimized_anew() -> None:
    _, graph, _ = _laps(laps=2)
    alone = PoseGraph(graph.poses, graph.steps, graph.closures.select(slice(0, 0)))
    solved = IncrementalSolver(alone)
    far = _between(np.array([0]), np.array([80]), np.array([[15.0, -15.0, 1.0]]), CLOSURE_SD / 10)
    poses = solved.add(far)
    together = optimize(PoseGraph(graph.poses, graph.steps, far))

    assert cost(poses, solved.graph.constraints) <= 1.02 * cost(together, solved.graph.constraints)


def test_relinearizing_completes_what_added_closures_left_undone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, graph, _ = _laps(laps=2)
    far = _between(np.array([0]), np.array([80]), np.array([[15.0, -15.0, 1.0]]), CLOSURE_SD / 10)
    least = cost(optimize(PoseGraph(graph.poses, graph.steps, far)), graph.steps + far)
    monkeypatch.setattr(incremental, "ITERATIONS_PER_CLOSURE", 1)
    hasty = IncrementalSolver(
        PoseGraph(graph.poses, graph.steps, graph.closures.select(slice(0, 0)))
    )
    poses = hasty.add(far)

    assert cost(poses, graph.steps + far) > 1.1 * least

    hasty.relinearize()
    assert cost(hasty.graph.poses, graph.steps + far) == pytest.approx(least, rel=0.02)


def test_sqrt_information_is_a_root_of_singular_information_too() -> None:
    random = np.random.default_rng(0).normal(size=(4, 3, 3))
    information = random @ random.transpose(0, 2, 1)
    information[2, 2, :] = information[2, :, 2] = 0.0
    root = sqrt_information(information)

    assert root @ root.transpose(0, 2, 1) == pytest.approx(information)


def test_a_closures_chi_square_is_what_it_adds_to_the_cost() -> None:
    _, graph, _ = _laps()
    solved = IncrementalSolver(
        PoseGraph(graph.poses, graph.steps, graph.closures.select(slice(0, 6)))
    )
    before = cost(solved.graph.poses, solved.graph.constraints)
    one = graph.closures.select(slice(6, 7))
    chi_square = solved.chi_square(one)
    solved.add(one)
    solved.relinearize()

    assert cost(solved.graph.poses, solved.graph.constraints) - before == pytest.approx(
        chi_square, rel=0.05
    )


@pytest.mark.parametrize("false", [0, 1, 5, 12])
@pytest.mark.parametrize("headings", [True, False])
def test_false_closures_are_outliers_and_true_ones_inliers(false: int, headings: bool) -> None:
    for seed in range(2):
        truth, graph, true = _laps(seed=seed, false=false)
        if not headings:
            graph.closures.information[:, 2, :] = 0.0
        hold = inliers(graph, 1e-3)

        assert not hold[~true].any()
        assert hold[true].mean() > 0.9

        kept = PoseGraph(graph.poses, graph.steps, graph.closures.select(hold))
        best = PoseGraph(graph.poses, graph.steps, graph.closures.select(true))
        assert _error_m(optimize(kept), truth) < 1.2 * _error_m(optimize(best), truth) + 0.05


def test_a_lone_closure_is_an_inlier_within_drift_and_an_outlier_beyond() -> None:
    _, graph, _ = _laps(laps=2)
    for off_m, holds in ((0.0, True), (60.0, False)):
        closure = _between(np.array([0]), np.array([80]), np.array([[off_m, 0.0, 0.0]]), CLOSURE_SD)
        assert inliers(PoseGraph(graph.poses, graph.steps, closure), 1e-3).tolist() == [holds]


def test_residuals_of_headings_are_wrapped() -> None:
    poses = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, -3.0]])
    known = _between(np.array([0]), np.array([1]), np.zeros((1, 3)), np.ones(3))

    assert residuals(poses, known)[0, 2] == pytest.approx(2 * np.pi - 6.0)
