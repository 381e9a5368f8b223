"""What the path remembers of landmarks, and what corrections make of it."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import Constraints, PoseGraph
from cogmap.geometry.se2 import compose, relative
from cogmap.schemas.nodes import Observations, PathSegment
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.correction.joint import with_landmarks
from cogmap.services.codelets.mapping.observations import Sightings, Viewpoint, extended
from cogmap.testing import percept
from tests.support.paths import mean_distance_m
from tests.support.world.scenes import Desk

STILL = np.zeros(3)
TOWER_M = np.array([6.0, 8.0])
ELSEWHERE_M = np.array([-40.0, 30.0])
SIDE_STEPS = 10


def _seen(desk: Desk) -> dict[str, int]:
    counts = {}
    for node in desk.graph.of_kind(Observations):
        counts[node.landmark] = len(node.rows.numpy())
    return counts


def _driven() -> np.ndarray:
    """(41, 3): round a square of 10 m sides, a step a metre."""
    poses = [STILL]
    for number in range(1, 41):
        at_corner = number % SIDE_STEPS == 0
        turn_rad = math.pi / 2 if at_corner else 0.0
        poses.append(compose(poses[-1], np.array([1.0, 0.0, turn_rad])))

    return np.array(poses)


def _tower(bearing_rad: float = 0.0, range_m: float = 10.0, **facts: float) -> Percept:
    return percept("tower", bearing_rad, range_m, **facts)


def _sightings(poses: np.ndarray, wrong: tuple[int, ...] = ()) -> list[Observations]:
    """The tower from every pose, and something elsewhere from those numbered `wrong`."""
    node: Observations | None = None
    for number, pose in enumerate(poses):
        off_m = ELSEWHERE_M if number in wrong else TOWER_M - pose[:2]
        range_m = math.hypot(*off_m)
        bearing_rad = math.atan2(off_m[1], off_m[0]) - pose[2]

        viewpoint = Viewpoint(0, float(number), STILL, 0.0)
        seen = _tower(bearing_rad, range_m, bearing_sd_rad=0.01, range_sd_m=0.1)
        node = extended(node, viewpoint, seen)

    return [node] if node else []


def _turning_excess(poses: np.ndarray) -> PoseGraph:
    """The path integrated with 0.03 rad more of turning a step, and no closures."""
    at = np.arange(len(poses) - 1)
    measured = relative(poses[:-1], poses[1:]) + np.array([0.0, 0.0, 0.03])
    information = np.tile(np.diag([1e2, 1e2, 1e3]), (len(at), 1, 1))
    steps = Constraints(at, at + 1, measured, information)

    bent = [poses[0]]
    for step in measured:
        bent.append(compose(bent[-1], step))

    return PoseGraph(np.array(bent), steps, steps.select(slice(0, 0)))


def test_a_landmark_is_remembered_once_from_each_place_of_the_path() -> None:
    desk = Desk("w1")
    desk.drive(range(3), percept("a"))
    (segment,) = desk.graph.of_kind(PathSegment)
    places = len(segment.rows.numpy())
    assert _seen(desk) == {"a": places}

    desk.see(3, percept("a"), percept("b"), rows=((0.0, 0.0, 0.2, 0.0, 0.0),))
    desk.work()
    assert _seen(desk) == {"a": places, "b": 1}


def test_what_is_seen_at_a_distance_from_a_place_is_kept_as_seen_from_it() -> None:
    since_place = np.array([2.0, 1.0, math.pi / 2])
    viewpoint = Viewpoint(0, 1.0, since_place, 0.0)
    node = extended(None, viewpoint, _tower())

    seen = Sightings.of([node], np.array([1.0]))
    assert seen.where_m[0] == pytest.approx((2.0, 11.0))


def test_an_eye_that_sees_too_far_is_known_to() -> None:
    too_far = 0.25
    viewpoint = Viewpoint(0, 1.0, STILL, too_far)
    node = extended(None, viewpoint, _tower())

    seen = Sightings.of([node], np.array([1.0]))
    assert seen.where_m[0] == pytest.approx((8.0, 0.0))


def test_sightings_of_a_part_count_where_the_size_of_the_landmark_is_known() -> None:
    viewpoint = Viewpoint(0, 1.0, STILL, 0.0)
    part = msgspec.structs.replace(_tower(), label="barn", whole=False)
    nodes = [extended(None, viewpoint, part), extended(None, viewpoint, _tower())]

    seen = Sightings.of(nodes, np.array([1.0]))
    whole = seen.of_known_extent(())

    assert seen.labels == ("barn", "tower")
    assert whole.labels == ("tower",)
    assert whole.landmark.tolist() == [0]
    assert whole.where_m == pytest.approx(seen.where_m[1:])
    assert seen.of_known_extent({"barn"}).labels == ("barn", "tower")


def test_a_landmark_stands_where_most_of_its_sightings_put_it() -> None:
    poses = _driven()
    wrong = tuple(range(0, 40, 3))
    stamps = np.arange(len(poses), dtype=float)
    seen = Sightings.of(_sightings(poses, wrong), stamps)

    (found,) = seen.landmarks_m(poses)
    assert found == pytest.approx(TOWER_M, abs=0.05)


def test_sightings_from_places_that_the_path_has_not_are_left_out() -> None:
    poses = _driven()
    seen = Sightings.of(_sightings(poses), np.array([3.0, 4.0]))

    assert seen.place.tolist() == [0, 1]


def test_observations_along_a_path_correct_its_excess_of_turning() -> None:
    truth = _driven()
    stamps = np.arange(len(truth), dtype=float)
    seen = Sightings.of(_sightings(truth), stamps)

    graph = _turning_excess(truth)
    before_m = mean_distance_m(graph.poses, truth)
    for _ in range(5):
        landmarks_m = seen.landmarks_m(graph.poses)
        joint = optimize(with_landmarks(graph, seen, landmarks_m))
        graph = PoseGraph(joint[: len(truth)], graph.steps, graph.closures)
    after_m = mean_distance_m(graph.poses, truth)

    assert before_m > 2.0
    assert after_m < 0.3 * before_m
