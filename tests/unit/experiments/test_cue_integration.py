from __future__ import annotations

import math

import numpy as np
import pytest

from experiments.cue_integration import analysis
from experiments.cue_integration.analysis import Gaussian
from experiments.cue_integration.fit import coordinate_descent
from experiments.cue_integration.geometry import (
    CONFLICT_RAD,
    POSTS,
    REACH_M,
    ROUTES,
    Pose,
    step,
    turned,
)
from experiments.cue_integration.run import Budget, Outcome, Session, measure
from experiments.cue_integration.senses import self_motion, sightings
from experiments.cue_integration.trial import Condition, Noise, Response, Trial

STILL = Noise(speed=1e-9, turn=1e-9, distance=1e-3)
NOISY = Noise(speed=0.15, turn=0.15)


def _trial(condition: Condition, number: int = 0, noise: Noise = NOISY) -> Trial:
    return Trial(condition, number, noise, seed=5)


def test_every_route_ends_at_post_8_and_15_degrees_move_its_target_46_cm() -> None:
    assert len(set(ROUTES)) == 8

    for target, _, last in ROUTES:
        assert last == 8
        (moved,) = turned((POSTS[target],), CONFLICT_RAD)
        assert math.dist(moved, POSTS[target]) == pytest.approx(0.457, abs=5e-4)


def test_steps_lead_to_a_goal_behind_one_until_it_is_within_reach() -> None:
    pose = Pose(1.0, 2.0, 0.0)
    goal = (-2.0, 2.5)
    for _ in range(12):
        pose = pose.after(*step(*pose.towards(goal)))

    assert pose.towards(goal) == pytest.approx((0.0, REACH_M))


def test_self_motion_is_multiplied_by_noise_of_mean_one() -> None:
    rng = np.random.default_rng(3)
    rows = np.array([self_motion(1.0, 0.5, Noise(0.1, 0.2), rng) for _ in range(4000)])
    turns = rows[:, 0, 1] * rows[:, 0, 2]
    ways = rows[:, 1, 0] * rows[:, 1, 2]

    assert (turns.mean(), turns.std()) == pytest.approx((1.0, 0.2), rel=0.05)
    assert (ways.mean(), ways.std()) == pytest.approx((0.5, 0.05), rel=0.05)


def test_the_uncertainty_of_self_motion_follows_from_what_is_sensed_alone() -> None:
    noise = Noise(0.2, 0.2)
    seeds = range(50)
    one = np.array([self_motion(1.0, 0.5, noise, np.random.default_rng(seed)) for seed in seeds])
    for row, column, felt in ((0, 4, 1), (1, 3, 0)):
        share = one[:, row, column] / np.abs(one[:, row, felt])
        assert share == pytest.approx(np.full(50, share[0]))
        assert 0.2 < share[0] < 0.25


def test_distances_err_by_three_percent_and_directions_by_as_much_across() -> None:
    rng = np.random.default_rng(3)
    seen = [
        sightings(Pose(0, 0, 0), {"star": (4.0, 0.0)}, Noise(0.1, 0.1), rng)[0] for _ in range(4000)
    ]

    assert np.std([percept.range_m for percept in seen]) == pytest.approx(0.12, rel=0.05)
    assert np.std([percept.bearing_rad for percept in seen]) == pytest.approx(0.03, rel=0.05)


@pytest.mark.parametrize("condition", [Condition.SELF_MOTION, Condition.BOTH])
def test_with_senses_that_hardly_err_the_post_is_put_back_where_it_stood(
    condition: Condition,
) -> None:
    trial = _trial(condition, 3, STILL)
    response = Session(trial).run()

    assert math.dist((response.x_m, response.y_m), trial.target) < 0.15


def test_after_disorientation_landmarks_lead_back() -> None:
    trial = _trial(Condition.LANDMARKS, 2)
    response = Session(trial).run()

    assert math.dist((response.x_m, response.y_m), trial.target) < 0.5


def test_landmarks_that_are_turned_lead_to_where_they_say() -> None:
    trial = _trial(Condition.CONFLICT, 9)
    response = Session(trial).run()
    where = (response.x_m, response.y_m)

    assert math.dist(where, trial.turned_target) < math.dist(where, trial.target)


def test_a_trial_says_the_same_bytes_each_time_and_others_in_another() -> None:
    sessions = [Session(_trial(Condition.BOTH, number)) for number in (4, 4, 12)]
    responses = [session.run() for session in sessions]
    first, again, other = (session.transcript.messages for session in sessions)

    assert responses[0] == responses[1] and first == again
    assert first["workspace/delta"] and first["workspace/delta"] != other["workspace/delta"]


def test_the_figures_do_not_depend_on_the_number_of_processes() -> None:
    few = (Condition.SELF_MOTION,)
    one, two = (measure(NOISY, Budget(2, 7, processes), few) for processes in (1, 2))

    assert np.array_equal(one.errors_m[few[0]], two.errors_m[few[0]])


def test_errors_lie_along_the_way_that_turned_landmarks_move_the_target() -> None:
    trials = [_trial(Condition.CONFLICT, number) for number in range(16)]
    assert {trial.side for trial in trials} == {1, -1}

    exactly = [Response(*trial.turned_target, 0) for trial in trials]
    assert analysis.errors(trials, exactly) == pytest.approx(
        np.tile([0.4569, 0.0], (16, 1)), abs=1e-4
    )

    at_post_8 = [Response(*POSTS[8], 0) for _ in trials]
    assert (analysis.errors(trials, at_post_8)[:, 1] > 1.7).all()


def test_errors_turn_with_the_landmarks() -> None:
    trials = [_trial(Condition.LANDMARKS, number) for number in range(16)]
    off = [(0.1, -0.3)] * 16
    put = [
        Response(trial.target[0] + x, trial.target[1] + y, 0)
        for trial, (x, y) in zip(trials, off, strict=True)
    ]
    moved = [
        Response(*turned(((response.x_m, response.y_m),), trial.side * CONFLICT_RAD)[0], 0)
        for trial, response in zip(trials, put, strict=True)
    ]
    shift_m = analysis.shift_m(trials)
    expected = analysis.turned_errors(analysis.errors(trials, put), shift_m)

    assert analysis.errors(trials, moved) == pytest.approx(expected, abs=1e-4)


def test_two_cues_combine_by_their_precision() -> None:
    assert analysis.landmark_weight(0.5, 0.4) == pytest.approx(0.25 / 0.41)
    assert analysis.optimal_sd_m(0.5, 0.4) == pytest.approx((0.5**-2 + 0.4**-2) ** -0.5)

    first, second = (
        Gaussian(np.array([x, 0.0]), np.eye(2) * sd**2) for x, sd in ((0.0, 0.5), (1.0, 0.4))
    )
    both = analysis.combined(first, second)

    assert both.mean_m == pytest.approx([0.25 / 0.41, 0.0])
    assert both.covariance_m2[0, 0] ** 0.5 == pytest.approx(analysis.optimal_sd_m(0.5, 0.4))


def _outcome(conflict_m: np.ndarray) -> Outcome:
    rng = np.random.default_rng(1)
    single = {
        Condition.SELF_MOTION: rng.normal(0, 0.35, (400, 2)),
        Condition.LANDMARKS: rng.normal(0, 0.28, (400, 2)),
        Condition.BOTH: rng.normal(0, 0.22, (400, 2)),
    }
    return Outcome(NOISY, {**single, Condition.CONFLICT: conflict_m}, 0.457)


def test_responses_between_the_cues_are_likelier_under_integration() -> None:
    rng = np.random.default_rng(2)
    weight = 0.35**2 / (0.35**2 + 0.28**2)
    between = rng.normal((weight * 0.457, 0), 0.22, (400, 2))
    follows = rng.random((400, 1)) < weight
    either = np.where(
        follows, rng.normal((0.457, 0), 0.28, (400, 2)), rng.normal(0, 0.35, (400, 2))
    )

    assert _outcome(between).metrics()["integration_over_best_alternation"] > 0
    assert _outcome(either).metrics()["integration_over_alternation"] < 0


def test_one_lost_trial_turns_the_sum_of_likelihoods_but_not_the_median() -> None:
    rng = np.random.default_rng(2)
    weight = 0.35**2 / (0.35**2 + 0.28**2)
    between = rng.normal((weight * 0.457, 0), 0.22, (400, 2))
    between[7] = (9.0, 7.0)
    figures = _outcome(between).metrics()

    assert figures["integration_over_alternation"] < 0
    assert figures["integration_over_alternation_median_of_a_trial"] > 0
    assert figures["integration_likelier_share"] > 0.5
    assert figures["lost_trials_conflict"] == 1.0 and figures["lost_trials_both"] == 0.0


def test_coordinate_descent_finds_the_lowest_cost() -> None:
    def cost(noise: Noise) -> float:
        return math.log(noise.speed / 0.3) ** 2 + math.log(noise.turn / 0.07) ** 2

    found = coordinate_descent(cost, Noise(0.1, 0.1), (1.5, 1.2, 1.05))
    assert (found.speed, found.turn) == pytest.approx((0.3, 0.07), rel=0.05)
