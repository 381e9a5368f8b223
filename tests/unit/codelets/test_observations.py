"""What the path remembers of landmarks, and what corrections make of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.geometry.se2 import compose, relative
from schemas.nodes import Observations, PathSegment
from services.codelets.correction.joint import with_landmarks
from services.codelets.correction.least_squares import optimize
from services.codelets.correction.pose_graph import Constraints, PoseGraph
from services.codelets.mapping.observations import Sightings, Viewpoint, extended
from tests.support.scenes import Desk, percept

STILL = np.zeros(3)
TOWER_M = np.array([6.0, 8.0])


def _seen(desk: Desk) -> dict[str, int]:
    return {node.landmark: len(node.rows.numpy()) for node in desk.graph.of_kind(Observations)}


def _driven() -> np.ndarray:
    """(41, 3): round a square of 10 m sides, a step a metre."""
    poses = [np.zeros(3)]
    for number in range(1, 41):
        poses.append(
            compose(poses[-1], np.array([1.0, 0.0, math.pi / 2 if number % 10 == 0 else 0.0]))
        )
    return np.array(poses)


def _sightings(poses: np.ndarray, wrong: tuple[int, ...] = ()) -> list[Observations]:
    node: Observations | None = None
    for number, pose in enumerate(poses):
        off = (np.array([-40.0, 30.0]) if number in wrong else TOWER_M) - pose[:2]
        bearing = math.atan2(off[1], off[0]) - pose[2]
        seen = percept("tower", bearing, math.hypot(*off), bearing_sd_rad=0.01, range_sd_m=0.1)
        node = extended(node, Viewpoint(0, float(number), STILL, 0.0), seen)
    return [node] if node else []


def test_a_landmark_is_remembered_once_from_each_place_of_the_path() -> None:
    desk = Desk("w1")
    desk.drive(range(3), percept("a"))
    (segment,) = desk.graph.of_kind(PathSegment)
    places = len(segment.rows.numpy())

    assert _seen(desk) == {"a": places}

    desk.see(3, percept("a"), percept("b"), rows=((0.0, 0.0, 0.2, 0.0, 0.0),))
    desk.work()
    assert _seen(desk) == {"a": places, "b": 1}


def test_what_is_seen_some_way_from_a_place_is_told_as_seen_from_the_place() -> None:
    ahead = percept("tower", 0.0, 10.0)
    node = extended(None, Viewpoint(0, 1.0, np.array([2.0, 1.0, math.pi / 2]), 0.0), ahead)
    seen = Sightings.of([node], np.array([1.0]))

    assert seen.where_m[0] == pytest.approx((2.0, 11.0))


def test_an_eye_that_sees_too_far_is_known_to() -> None:
    node = extended(None, Viewpoint(0, 1.0, STILL, 0.25), percept("tower", 0.0, 10.0))

    assert Sightings.of([node], np.array([1.0])).where_m[0] == pytest.approx((8.0, 0.0))


def test_a_landmark_stands_where_most_of_its_sightings_put_it() -> None:
    poses = _driven()
    stamps = np.arange(len(poses), dtype=float)
    wrong = tuple(range(0, 40, 3))
    (found,) = Sightings.of(_sightings(poses, wrong), stamps).landmarks_m(poses)

    assert found == pytest.approx(TOWER_M, abs=0.05)


def test_sightings_from_places_that_the_path_has_not_are_left_out() -> None:
    poses = _driven()
    seen = Sightings.of(_sightings(poses), np.array([3.0, 4.0]))

    assert seen.place.tolist() == [0, 1]


def test_observations_along_a_path_correct_its_excess_of_turning() -> None:
    poses = _driven()
    at = np.arange(len(poses) - 1)
    measured = relative(poses[:-1], poses[1:]) + np.array([0.0, 0.0, 0.03])
    information = np.tile(np.diag([1e2, 1e2, 1e3]), (len(at), 1, 1))
    bent = [poses[0]]
    for step in measured:
        bent.append(compose(bent[-1], step))
    start = np.array(bent)
    none = Constraints(at[:0], at[:0], np.zeros((0, 3)), np.zeros((0, 3, 3)))
    graph = PoseGraph(start, Constraints(at, at + 1, measured, information), none)
    seen = Sightings.of(_sightings(poses), np.arange(len(poses), dtype=float))
    for _ in range(5):
        landmarks_m = seen.landmarks_m(graph.poses)
        joint = optimize(with_landmarks(graph, seen, landmarks_m))
        graph = PoseGraph(joint[: len(poses)], graph.steps, none)
    before, after = (
        np.hypot(*(path[:, :2] - poses[:, :2]).T).mean() for path in (start, graph.poses)
    )

    assert before > 2.0
    assert after < 0.3 * before
