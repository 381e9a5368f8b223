"""The path optimized together with what was seen along it, side by side of each landmark."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import Constraints, PoseGraph
from cogmap.geometry.se2 import integrate, transform_to
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.correction.joint import by_side, optimize_jointly
from cogmap.services.codelets.mapping.observations import Sightings
from cogmap.services.codelets.mapping.ranges import Ranges
from tests.support.paths import mean_distance_m

SIDE = 20
LAP = 4 * SIDE
LANDMARKS = {"tower": np.array([10.0, 10.0]), "mill": np.array([25.0, 5.0])}
STEP_VARIANCE = np.array([1e-3, 1e-3, 1e-5])
SIGHTING_SD_M = 0.5
NEARER_M = 1.0
NOTHING_HEARD = Ranges.of([], np.zeros(0))


def _steps(laps: int, turn_error_rad: float = 0.0) -> Constraints:
    """Metre by metre round a square, counter-clockwise."""
    count = laps * LAP
    measurement = np.tile([1.0, 0.0, turn_error_rad], (count, 1))
    measurement[SIDE - 1 :: SIDE, 2] += np.pi / 2
    information = np.tile(np.diag(1 / STEP_VARIANCE), (count, 1, 1))

    at = np.arange(count)
    return Constraints(at, at + 1, measurement, information)


def _sightings(truth: np.ndarray) -> Sightings:
    """Both landmarks from every place; each seems to stand nearer than it does, as a wide building
    seems whose front alone is seen.
    """
    seen_m = []
    for position_m in LANDMARKS.values():
        where_m = transform_to(truth, position_m)
        range_m = np.hypot(*where_m.T)
        seen_m.append(where_m * (1 - NEARER_M / range_m)[:, None])

    count = len(truth)
    places = np.tile(np.arange(count), len(LANDMARKS))
    landmark = np.repeat(np.arange(len(LANDMARKS)), count)
    information = np.tile(np.eye(2) / SIGHTING_SD_M**2, (len(places), 1, 1))
    whole = np.ones(len(places), bool)
    return Sightings(tuple(LANDMARKS), places, landmark, np.vstack(seen_m), information, whole)


def _graph(steps: Constraints) -> PoseGraph:
    poses = integrate(np.zeros(3), steps.measurement)
    return PoseGraph(poses, steps, steps.select(slice(0, 0)))


def test_a_landmark_has_a_label_for_each_side_that_it_is_seen_from() -> None:
    truth = _graph(_steps(1)).poses
    sides = by_side(_sightings(truth), truth, 4)

    of_tower = [label for label in sides.labels if label == "tower"]
    here = sides.landmark[2]
    opposite = sides.landmark[LAP // 2 + 2]

    assert len(of_tower) == 4
    assert here != opposite


def test_with_one_side_a_landmark_stays_one() -> None:
    truth = _graph(_steps(1)).poses
    seen = _sightings(truth)
    one_side = by_side(seen, truth, 1)

    assert one_side.landmark.tolist() == seen.landmark.tolist()


@pytest.mark.parametrize("landmarks", ["points", "buildings"])
def test_a_bias_by_side_bends_a_good_path_only_as_a_single_landmark(
    landmarks: Literal["points", "buildings"],
) -> None:
    graph = _graph(_steps(1))
    seen = _sightings(graph.poses)
    config = Config(landmarks=landmarks)

    poses, _ = optimize_jointly(graph, seen, NOTHING_HEARD, config)
    bent_m = mean_distance_m(poses, graph.poses)

    assert bent_m > 0.2 if landmarks == "points" else bent_m < 0.1


def test_sides_bind_the_second_lap_to_the_first() -> None:
    truth = _graph(_steps(2)).poses
    drifted = _graph(_steps(2, turn_error_rad=0.0005))
    seen = _sightings(truth)

    alone = optimize(drifted)
    joint, _ = optimize_jointly(drifted, seen, NOTHING_HEARD, Config())

    alone_m = mean_distance_m(alone[LAP : 2 * LAP], alone[:LAP])
    joint_m = mean_distance_m(joint[LAP : 2 * LAP], joint[:LAP])
    assert joint_m < 0.5 * alone_m


def test_a_path_without_sightings_is_optimized_alone() -> None:
    graph = _graph(_steps(1))
    none = np.zeros(0, int)
    nothing = Sightings((), none, none, np.zeros((0, 2)), np.zeros((0, 2, 2)), none > 0)

    poses, _ = optimize_jointly(graph, nothing, NOTHING_HEARD, Config())
    assert poses == pytest.approx(optimize(graph))


def test_points_along_an_open_path_correct_what_is_believed_not_path_integration() -> None:
    """Headings drift by 8 rad in two laps: so far off, the least squares end in another minimum."""
    truth = _graph(_steps(2)).poses
    steps = _steps(2, turn_error_rad=0.05)
    steps.information[:, 2, 2] = 1 / 1e-3
    drifted = _graph(steps)
    believed = replace(drifted, poses=truth)
    config = Config(landmarks="points")

    from_belief, _ = optimize_jointly(believed, _sightings(truth), NOTHING_HEARD, config)
    from_integration, _ = optimize_jointly(drifted, _sightings(truth), NOTHING_HEARD, config)

    assert mean_distance_m(from_belief, truth) < 1.5
    assert mean_distance_m(from_integration, truth) > 2.5
