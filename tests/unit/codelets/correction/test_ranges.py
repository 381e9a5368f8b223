"""A path bound to landmarks that are known by their range alone."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.estimation.alignment import motion_onto
from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import NO_CONSTRAINTS, Constraints, PoseGraph
from cogmap.geometry.se2 import integrate, transform_from
from cogmap.schemas.nodes import LoopClosure, Observations
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.correction.joint import optimize_jointly
from cogmap.services.codelets.mapping.observations import Sightings, Viewpoint, extended
from cogmap.services.codelets.mapping.ranges import MIN_RANGES, Ranges
from cogmap.testing import percept
from tests.support.paths import mean_distance_m
from tests.support.world.scenes import Desk

BEACONS_M = {"north": np.array([5.0, 40.0]), "east": np.array([35.0, 5.0])}
SIDE = 20
LAPS = 3
TURN_ERROR_RAD = 0.004
RANGE_SD_M = 0.3
NOTHING_SEEN = Sightings.of([], np.zeros(0))


def _path(turn_error_rad: float) -> PoseGraph:
    """Metre by metre round a square of 20 m, three times, by turns that err by so much a step."""
    count = LAPS * 4 * SIDE
    measured = np.tile([1.0, 0.0, turn_error_rad], (count, 1))
    measured[SIDE - 1 :: SIDE, 2] += np.pi / 2
    information = np.tile(np.diag([1e2, 1e2, 1e4]), (count, 1, 1))
    at = np.arange(count)
    steps = Constraints(at, at + 1, measured, information)
    return PoseGraph(integrate(np.zeros(3), measured), steps, NO_CONSTRAINTS)


def _heard(label: str, range_m: float) -> Percept:
    return percept(label, 0.0, range_m, bearing_sd_rad=np.pi, range_sd_m=RANGE_SD_M)


def _ranges(truth: np.ndarray, gain: float = 0.0) -> Ranges:
    """Both beacons in turn, from each place."""
    rng = np.random.default_rng(4)
    records: dict[str, Observations] = {}
    labels = list(BEACONS_M)
    for number, pose in enumerate(truth):
        label = labels[number % 2]
        away_m = float(np.hypot(*(BEACONS_M[label] - pose[:2])))
        range_m = (1 + gain) * away_m + rng.normal(0.0, RANGE_SD_M)
        viewpoint = Viewpoint(0, float(number), np.zeros(3), 0.0)
        records[label] = extended(records.get(label), viewpoint, _heard(label, range_m))

    return Ranges.of(records.values(), np.arange(len(truth), dtype=float))


def _error_m(poses: np.ndarray, truth: np.ndarray) -> float:
    """Ranges say where each place is from the others: the frame is left to the first of them."""
    motion = motion_onto(poses[:, :2], truth[:, :2])
    aligned = poses.copy()
    aligned[:, :2] = transform_from(motion, poses[:, :2])
    return mean_distance_m(aligned, truth)


@pytest.mark.parametrize("gain", [0.0, 0.06])
def test_ranges_alone_straighten_a_path_that_turns_wrongly(gain: float) -> None:
    truth = _path(0.0).poses
    drifted = _path(TURN_ERROR_RAD)

    poses, rounds = optimize_jointly(drifted, NOTHING_SEEN, _ranges(truth, gain), Config())

    assert rounds > 1
    assert _error_m(optimize(drifted), truth) > 2.0
    assert _error_m(poses, truth) < 0.5


def test_a_landmark_heard_from_few_places_binds_nothing() -> None:
    places = np.arange(MIN_RANGES - 1.0)
    record: Observations | None = None
    for stamp_s in places.tolist():
        viewpoint = Viewpoint(0, stamp_s, np.zeros(3), 0.0)
        record = extended(record, viewpoint, _heard("north", 30.0))

    assert record is not None
    assert Ranges.of([record], places).labels == ()


def test_a_range_alone_is_kept_beside_what_is_seen_of_the_landmark() -> None:
    viewpoint = Viewpoint(0, 1.0, np.array([0.5, 0.1, 0.2]), 0.0)
    seen = extended(None, viewpoint, percept("north", 0.0, 10.0))
    both = extended(seen, viewpoint, _heard("north", 30.0))

    assert both.rows == seen.rows
    assert both.ranges is not None
    assert both.ranges.numpy().tolist() == [[1.0, 0.5, 0.1, 30.0, RANGE_SD_M]]


def test_a_beacon_that_is_heard_all_the_time_closes_a_loop_now_and_then() -> None:
    desk = Desk("w1")
    desk.drive(range(400), _heard("north", 30.0))

    closures = list(desk.graph.of_kind(LoopClosure))
    apart_s = np.diff(sorted(closure.to_ns * 1e-9 for closure in closures))
    assert closures
    assert all(closure.range_alone for closure in closures)
    assert (apart_s >= 20.0).all()
