"""The benchmark of places by sequence drives where it says, and counts as it says."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from benchmarks.perception.sequence import (
    FIRST_LAP,
    OFFSET_M,
    SECOND_LAP,
    SIDE_STREET,
    STEP_M,
    STEPS_M,
    TURN_RAD,
    Answer,
    course,
    metrics,
    poses,
    recall,
)
from cogmap.schemas.sensing import PlaceMatch, Pose
from cogmap.services.sim.layout import town

LINE = [(0.0, 0.0), (40.0, 0.0), (40.0, 30.0)]
EASTWARDS = [(0.0, 0.0), (80.0, 0.0)]


def test_a_lap_takes_even_steps_and_rounds_its_corners() -> None:
    lap = poses(LINE, np.random.default_rng(0), STEP_M)
    steps_m = []
    turns_rad = []
    for before, after in itertools.pairwise(lap):
        steps_m.append(math.hypot(after.x_m - before.x_m, after.y_m - before.y_m))
        turns_rad.append(after.heading_rad - before.heading_rad)

    assert np.allclose(steps_m, STEP_M[0], atol=0.02)
    assert max(turns_rad) < 0.4
    assert lap[0].heading_rad == pytest.approx(0.0, abs=1e-6)
    assert lap[-1].heading_rad == pytest.approx(math.pi / 2, abs=1e-6)


def test_another_lap_keeps_near_the_line_and_its_direction() -> None:
    rng = np.random.default_rng(3)
    lap = poses(EASTWARDS, rng, STEPS_M, OFFSET_M, TURN_RAD)
    aside_m = np.abs([pose.y_m for pose in lap])
    turned_rad = np.abs([pose.heading_rad for pose in lap])
    steps_m = np.diff([pose.x_m for pose in lap])

    assert 0.2 < aside_m.max() <= OFFSET_M
    assert 0.02 < turned_rad.max() <= TURN_RAD
    assert STEPS_M[0] - 0.05 < steps_m.min() < 0.8
    assert 0.8 < steps_m.max() < STEPS_M[1] + 0.05


def test_the_second_lap_has_another_light() -> None:
    first, side, second = course(town.generate(5))

    assert first.part == FIRST_LAP
    assert side.part == SIDE_STREET
    assert second.part == SECOND_LAP
    assert first.light == side.light != second.light


def test_recall_is_that_at_the_lowest_score_precise_enough() -> None:
    score = np.array([0.9, 0.8, 0.7, 0.6, 0.5, 0.0])
    right = np.array([True, True, True, False, True, False])
    wanted = np.ones(6, bool)
    without_a_mistake = recall(score, right, wanted, 0.99)
    with_one_in_five = recall(score, right, wanted, 0.8)
    first_ones_wrong = recall(score, ~right, wanted, 0.99)

    assert without_a_mistake == pytest.approx(3 / 6)
    assert with_one_in_five == pytest.approx(4 / 6)
    assert first_ones_wrong == 0.0


def _answer(
    part: int, x_m: float, frame: int | None = None, seed: int = 1, heading_rad: float = 0.0
) -> Answer:
    pose = Pose(x_m=x_m, y_m=0.0, heading_rad=heading_rad)
    match = None if frame is None else PlaceMatch(frame=frame, view_ns=0, score=0.95)
    return Answer(seed, part, pose, match)


def test_a_match_is_right_only_at_the_same_place_of_the_town_and_heading() -> None:
    before = [_answer(FIRST_LAP, x_m) for x_m in (0.0, 10.0, 20.0)]
    measured = metrics(
        [
            *before,
            _answer(FIRST_LAP, 30.0, frame=0),
            _answer(SECOND_LAP, 2.0, frame=0),
            _answer(SECOND_LAP, 10.0, frame=0),
            _answer(SECOND_LAP, 20.0, frame=2, heading_rad=math.pi),
            _answer(SECOND_LAP, 0.0, frame=0, seed=2),
        ]
    )

    assert measured["sequence_precision"] == pytest.approx(1 / 5)
    assert measured["sequence_recall"] == pytest.approx(1 / 2)
    assert measured["sequence_false_outside_second_lap"] == 1
