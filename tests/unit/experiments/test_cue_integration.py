"""Homing by self-motion and landmarks: trials, senses, errors and models of the responses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from cogmap.experiments.cue_integration import analysis, walk
from cogmap.experiments.cue_integration.analysis import Gaussian
from cogmap.experiments.cue_integration.fit import coordinate_descent
from cogmap.experiments.cue_integration.geometry import (
    CONFLICT_RAD,
    POSTS,
    REACH_M,
    ROUTES,
    Pose,
    step,
    turned,
)
from cogmap.experiments.cue_integration.run import (
    Budget,
    Outcome,
    Session,
    measure,
    measure_seeds,
    metrics_of_seeds,
)
from cogmap.experiments.cue_integration.senses import self_motion, sightings
from cogmap.experiments.cue_integration.trial import Condition, Noise, Response, Trial

STILL = Noise(speed=1e-9, turn=1e-9, landmark=1e-3)
NOISY = Noise(speed=0.15, turn=0.15)
Point = tuple[float, float]
SELF_MOTION_SD_M = 0.35
LANDMARKS_SD_M = 0.28
BOTH_SD_M = 0.22
SHIFT_M = 0.457


def _trial(condition: Condition, number: int = 0, noise: Noise = NOISY) -> Trial:
    return Trial(condition, number, noise, seed=5)


def test_every_route_ends_at_post_8_and_15_degrees_move_its_target_46_cm() -> None:
    assert len(set(ROUTES)) == 8

    for target, _, last in ROUTES:
        (moved,) = turned((POSTS[target],), CONFLICT_RAD)

        assert last == 8
        assert math.dist(moved, POSTS[target]) == pytest.approx(SHIFT_M, abs=5e-4)


def test_steps_lead_to_a_goal_behind_one_until_it_is_within_reach() -> None:
    pose = Pose(1.0, 2.0, 0.0)
    goal = (-2.0, 2.5)

    for _ in range(12):
        towards = pose.towards(goal)
        pose = pose.after(*step(*towards))

    assert pose.towards(goal) == pytest.approx((0.0, REACH_M))


def _self_motion(noise: Noise, rng: np.random.Generator) -> np.ndarray:
    """(2, 5): the rows of self-motion of a turn by 1 rad and a step of 0.5 m."""
    return self_motion(1.0, 0.5, noise, rng)


def test_self_motion_is_multiplied_by_noise_of_mean_one() -> None:
    rng = np.random.default_rng(3)
    noise = Noise(0.1, 0.2)
    rows = np.array([_self_motion(noise, rng) for _ in range(4000)])

    speed_m_s, turn_rate_rad_s, duration_s = rows[..., :3].transpose(2, 0, 1)
    turns_rad = (turn_rate_rad_s * duration_s)[:, 0]
    distances_m = (speed_m_s * duration_s)[:, 1]

    assert turns_rad.mean() == pytest.approx(1.0, rel=0.05)
    assert turns_rad.std() == pytest.approx(0.2, rel=0.05)
    assert distances_m.mean() == pytest.approx(0.5, rel=0.05)
    assert distances_m.std() == pytest.approx(0.05, rel=0.05)


def test_the_uncertainty_of_self_motion_follows_from_what_is_sensed_alone() -> None:
    noise = Noise(0.2, 0.2)
    motions = []
    for seed in range(50):
        rng = np.random.default_rng(seed)
        motions.append(_self_motion(noise, rng))
    rows = np.array(motions)

    turn_shares = rows[:, 0, 4] / np.abs(rows[:, 0, 1])
    speed_shares = rows[:, 1, 3] / np.abs(rows[:, 1, 0])

    for shares in (turn_shares, speed_shares):
        assert shares == pytest.approx(np.full(50, shares[0]))
        assert 0.2 < shares[0] < 0.25


def test_distances_err_by_their_share_and_directions_by_as_much_across() -> None:
    rng = np.random.default_rng(3)
    noise = Noise(0.1, 0.1, landmark=0.03)
    star = {"landmark-0": (4.0, 0.0)}
    ranges_m = []
    bearings_rad = []
    for _ in range(4000):
        (percept,) = sightings(Pose(0, 0, 0), star, noise, rng)
        ranges_m.append(percept.range_m)
        bearings_rad.append(percept.bearing_rad)

    assert np.std(ranges_m) == pytest.approx(0.12, rel=0.05)
    assert np.std(bearings_rad) == pytest.approx(0.03, rel=0.05)


def test_what_is_touched_errs_as_in_the_paper_however_landmarks_do() -> None:
    rng = np.random.default_rng(3)
    noise = Noise(0.1, 0.1, landmark=0.3)
    post = {"post-0": (0.3, 0.0)}
    ranges_m = [sightings(Pose(0, 0, 0), post, noise, rng)[0].range_m for _ in range(2000)]

    assert np.std(ranges_m) == pytest.approx(0.009, rel=0.1)


def test_by_range_alone_a_landmark_shows_its_distance_and_no_direction() -> None:
    rng = np.random.default_rng(3)
    noise = Noise(0.1, 0.1, landmark=0.03, range_only=True)
    things = {"landmark-0": (4.0, 3.0), "post-0": (0.3, 0.0)}

    landmark, post = sightings(Pose(0, 0, 0), things, noise, rng)

    assert landmark.has_range
    assert not landmark.has_bearing
    assert landmark.range_m == pytest.approx(5.0, rel=0.15)
    assert post.has_bearing


def _response(trial: Trial) -> Point:
    """Where the post is put back."""
    response = Session(trial).run()
    return response.x_m, response.y_m


@pytest.mark.parametrize("condition", [Condition.SELF_MOTION, Condition.BOTH])
def test_with_senses_that_hardly_err_the_post_is_put_back_where_it_stood(
    condition: Condition,
) -> None:
    trial = _trial(condition, 3, STILL)
    put_m = _response(trial)

    assert math.dist(put_m, trial.target) < 0.15


def test_after_disorientation_landmarks_lead_back() -> None:
    trial = _trial(Condition.LANDMARKS, 2)
    put_m = _response(trial)

    assert math.dist(put_m, trial.target) < 0.5


def test_landmarks_that_are_turned_turn_the_response_with_them() -> None:
    trial = _trial(Condition.CONFLICT, 9)
    put_m = _response(trial)
    to_turned_m = math.dist(put_m, trial.turned_target)
    to_target_m = math.dist(put_m, trial.target)

    assert to_turned_m < to_target_m


def _run(number: int) -> tuple[Response, Mapping[str, Sequence[bytes]]]:
    """The response of a trial with both cues, and the messages of its session."""
    session = Session(_trial(Condition.BOTH, number))
    response = session.run()
    return response, session.transcript.messages


def test_a_trial_publishes_the_same_bytes_each_time_and_another_others() -> None:
    response, messages = _run(4)
    same_response, same_messages = _run(4)
    _, others = _run(12)

    assert same_response == response
    assert same_messages == messages
    assert messages["workspace/delta"]
    assert messages["workspace/delta"] != others["workspace/delta"]


def test_each_return_from_one_walk_is_that_of_a_trial_on_the_bus() -> None:
    conditions = tuple(Condition)
    returns = walk.responses(_trial(Condition.BOTH, 3), conditions)

    alone = [Session(_trial(condition, 3)).run() for condition in conditions]
    assert returns == alone
    assert len({response.position for response in returns}) == len(conditions)


def _trials(condition: Condition) -> list[Trial]:
    return [_trial(condition, number) for number in range(16)]


def test_steps_felt_after_disorientation_change_only_that_condition() -> None:
    felt = Noise(NOISY.speed, NOISY.turn, felt=True)

    for condition, is_changed in ((Condition.BOTH, False), (Condition.LANDMARKS, True)):
        felt_m = _response(_trial(condition, 1, felt))
        unfelt_m = _response(_trial(condition, 1))
        assert (felt_m != unfelt_m) == is_changed


def test_trials_by_range_alone_end_with_a_response() -> None:
    noise = Noise(0.1, 0.1, landmark=0.03, range_only=True)
    put_m = _response(_trial(Condition.BOTH, 1, noise))

    assert math.dist(put_m, POSTS[8]) < 10.0


def test_after_one_look_in_the_dark_the_place_is_known_roughly() -> None:
    trial = _trial(Condition.BOTH, 3, STILL)
    first_look = Session(trial).run().first_look

    assert math.dist(first_look, trial.target) < 0.15


def test_each_seed_gives_the_outcome_that_it_gives_alone() -> None:
    condition = Condition.SELF_MOTION
    both = measure_seeds(NOISY, Budget(2, 7, 1), 2, (condition,))
    second = measure(NOISY, Budget(2, 8, 1), (condition,))

    assert np.array_equal(both[1].errors_m[condition], second.errors_m[condition])
    assert not np.array_equal(both[0].errors_m[condition], second.errors_m[condition])


def test_the_metrics_do_not_depend_on_the_number_of_processes() -> None:
    condition = Condition.SELF_MOTION
    in_one = measure(NOISY, Budget(2, 7, 1), (condition,))
    in_two = measure(NOISY, Budget(2, 7, 2), (condition,))

    errors_m = in_one.errors_m[condition]
    assert np.array_equal(in_two.errors_m[condition], errors_m)


def test_errors_lie_along_the_shift_of_the_target_by_turned_landmarks() -> None:
    trials = _trials(Condition.CONFLICT)
    assert {trial.side for trial in trials} == {1, -1}

    at_turned = [trial.turned_target for trial in trials]
    along_m, aside_m = analysis.errors(trials, at_turned).T
    assert along_m == pytest.approx(0.4569, abs=1e-4)
    assert aside_m == pytest.approx(0.0, abs=1e-4)

    at_post_8 = [POSTS[8]] * len(trials)
    _, aside_m = analysis.errors(trials, at_post_8).T
    assert (aside_m > 1.7).all()


def test_errors_turn_with_the_landmarks() -> None:
    trials = _trials(Condition.LANDMARKS)
    put = []
    moved = []
    for trial in trials:
        x_m, y_m = trial.target[0] + 0.1, trial.target[1] - 0.3
        (turned_m,) = turned(((x_m, y_m),), trial.side * CONFLICT_RAD)
        put.append((x_m, y_m))
        moved.append(turned_m)

    errors_m = analysis.errors(trials, put)
    expected_m = analysis.turned_errors(errors_m, analysis.shift_m(trials))

    assert analysis.errors(trials, moved) == pytest.approx(expected_m, abs=1e-4)


def test_two_cues_combine_by_their_precision() -> None:
    weight = 0.25 / 0.41
    sd_m = (0.5**-2 + 0.4**-2) ** -0.5
    assert analysis.landmark_weight(0.5, 0.4) == pytest.approx(weight)
    assert analysis.optimal_sd_m(0.5, 0.4) == pytest.approx(sd_m)

    by_self_motion = Gaussian(np.array([0.0, 0.0]), np.eye(2) * 0.5**2)
    by_landmarks = Gaussian(np.array([1.0, 0.0]), np.eye(2) * 0.4**2)
    both = analysis.combined(by_self_motion, by_landmarks)
    variances_m2 = np.diag(both.covariance_m2)

    assert both.mean_m == pytest.approx([weight, 0.0])
    assert variances_m2[0] == pytest.approx(sd_m**2)


def _outcome(conflict_m: np.ndarray) -> Outcome:
    rng = np.random.default_rng(1)
    errors_m = {
        Condition.SELF_MOTION: rng.normal(0, SELF_MOTION_SD_M, (400, 2)),
        Condition.LANDMARKS: rng.normal(0, LANDMARKS_SD_M, (400, 2)),
        Condition.BOTH: rng.normal(0, BOTH_SD_M, (400, 2)),
        Condition.CONFLICT: conflict_m,
    }
    return Outcome(NOISY, errors_m, SHIFT_M)


def _landmark_weight() -> float:
    """The weight of landmarks in a response that combines both cues by their precision."""
    self_motion_m2 = SELF_MOTION_SD_M**2
    landmarks_m2 = LANDMARKS_SD_M**2
    return self_motion_m2 / (self_motion_m2 + landmarks_m2)


def _between(rng: np.random.Generator) -> np.ndarray:
    """(400, 2): errors of responses between the cues, weighted by their precision."""
    return rng.normal((_landmark_weight() * SHIFT_M, 0), BOTH_SD_M, (400, 2))


def test_responses_between_the_cues_are_likelier_under_integration() -> None:
    rng = np.random.default_rng(2)
    between = _between(rng)
    follows = rng.random((400, 1)) < _landmark_weight()
    by_landmarks = rng.normal((SHIFT_M, 0), LANDMARKS_SD_M, (400, 2))
    by_self_motion = rng.normal(0, SELF_MOTION_SD_M, (400, 2))
    either = np.where(follows, by_landmarks, by_self_motion)

    integrating = _outcome(between).metrics()
    alternating = _outcome(either).metrics()

    assert integrating["integration_over_best_alternation"] > 0
    assert alternating["integration_over_alternation"] < 0


def test_one_lost_trial_is_counted_and_decides_nothing() -> None:
    between = _between(np.random.default_rng(2))
    before = _outcome(between).metrics()
    between[7] = (9.0, 7.0)
    metrics = _outcome(between).metrics()

    assert metrics["integration_over_alternation"] > 0
    for key in ("integration_over_alternation", "conflict_sd_m", "conflict_rmse_m"):
        assert metrics[key] == pytest.approx(before[key], rel=0.05)
    assert metrics["conflict_lost_trials"] == 1.0
    assert metrics["both_lost_trials"] == 0.0


def test_seeds_near_the_optimum_are_counted_and_their_ratios_averaged() -> None:
    between = _between(np.random.default_rng(2))
    near = _outcome(between)
    errors_m = dict(near.errors_m)
    errors_m[Condition.BOTH] = 1.5 * errors_m[Condition.BOTH]
    far = Outcome(NOISY, errors_m, SHIFT_M)

    metrics = metrics_of_seeds([near, far], 4)

    ratios = [near.both_over_optimal, far.both_over_optimal]
    assert metrics["sd_both_over_optimal"] == pytest.approx(np.mean(ratios))
    assert metrics["sd_both_over_optimal_seed_4"] == pytest.approx(ratios[0])
    assert metrics["sd_both_over_optimal_seed_5"] == pytest.approx(1.5 * ratios[0])
    assert metrics["sd_both_over_optimal_within_share"] == 0.5
    assert metrics["trials_a_condition"] == 800.0


def test_coordinate_descent_finds_the_lowest_cost() -> None:
    def cost(noise: Noise) -> float:
        off_speed = math.log(noise.speed / 0.3)
        off_turn = math.log(noise.turn / 0.07)
        return off_speed**2 + off_turn**2

    start = Noise(0.1, 0.1)
    found = coordinate_descent(cost, start, (1.5, 1.2, 1.05))

    assert found.speed == pytest.approx(0.3, rel=0.05)
    assert found.turn == pytest.approx(0.07, rel=0.05)


def test_coordinate_descent_changes_only_what_it_is_to_fit() -> None:
    def cost(noise: Noise) -> float:
        return math.log(noise.landmark / 0.3) ** 2 + math.log(noise.speed / 0.2) ** 2

    found = coordinate_descent(cost, Noise(0.1, 0.1, 0.1), (1.2, 1.05), ("landmark",))

    assert found.landmark == pytest.approx(0.3, rel=0.05)
    assert found.speed == 0.1
