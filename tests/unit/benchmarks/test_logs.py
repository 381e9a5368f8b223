"""Logs of trees and of beacons as percepts, and what paths are compared with on them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.localization import beacons, gps, range_batch, trees
from benchmarks.localization.nearest_neighbour import NearestNeighbour
from benchmarks.localization.without_names import without_names
from cogmap.data.plaza import RangeLog
from cogmap.data.victoria_park import LASER_AHEAD_M, LASER_LEFT_M, TreeLog
from cogmap.geometry.arrays import Floats

TREES_M = np.array([[12.0, 3.0], [4.0, 14.0], [-8.0, 9.0], [2.0, -6.0], [-10.0, -4.0]])
BEACONS_M = {1: (20.0, 0.0), 5: (-5.0, 25.0), 6: (-15.0, -10.0)}
SPEED_M_S = 1.0
TURN_RATE_RAD_S = 0.2
LASTS_S = 63.0


def _circle() -> Floats:
    """(n, 4) stamps and poses round a circle of 5 m, twice."""
    stamps_s = np.arange(0.0, LASTS_S, 0.1)
    heading_rad = TURN_RATE_RAD_S * stamps_s
    radius_m = SPEED_M_S / TURN_RATE_RAD_S
    x_m = radius_m * np.sin(heading_rad)
    y_m = radius_m * (1 - np.cos(heading_rad))
    return np.column_stack([stamps_s, x_m, y_m, heading_rad])


def _tree_log(noise: float = 1.0) -> TreeLog:
    rng = np.random.default_rng(2)
    truth = _circle()
    odometry = np.tile([0.0, SPEED_M_S, TURN_RATE_RAD_S], (len(truth), 1))
    odometry[:, 0] = truth[:, 0]

    rows = []
    for stamp_s, x_m, y_m, heading_rad in truth[5::5].tolist():
        offset_m = TREES_M - (x_m, y_m)
        turn = np.array(
            [
                [np.cos(heading_rad), -np.sin(heading_rad)],
                [np.sin(heading_rad), np.cos(heading_rad)],
            ]
        )
        ahead_m, left_m = (offset_m @ turn - (LASER_AHEAD_M, LASER_LEFT_M)).T
        for ahead, left in zip(ahead_m.tolist(), left_m.tolist(), strict=True):
            range_m = np.hypot(ahead, left) + noise * rng.normal(0.0, 0.1)
            bearing_rad = np.arctan2(left, ahead) + noise * rng.normal(0.0, 0.01)
            if range_m > 1.0:
                rows.append((stamp_s, range_m, bearing_rad, 0.4))

    return TreeLog("made up", odometry, np.array(rows), truth[:, :3], 0)


def _range_log(gain: float) -> RangeLog:
    rng = np.random.default_rng(2)
    truth = _circle()
    odometry = np.tile([0.0, 0.1 * SPEED_M_S, 0.1 * TURN_RATE_RAD_S], (len(truth), 1))
    odometry[:, 0] = truth[:, 0]
    odometry[:, 1] *= 1 + rng.normal(0.0, 0.3, len(truth))

    rows = []
    for index, (stamp_s, x_m, y_m, _) in enumerate(truth[5::2].tolist()):
        number = list(BEACONS_M)[index % len(BEACONS_M)]
        beacon_x_m, beacon_y_m = BEACONS_M[number]
        range_m = (1 + gain) * np.hypot(beacon_x_m - x_m, beacon_y_m - y_m)
        rows.append((stamp_s, number, range_m + rng.normal(0.0, 0.2)))

    return RangeLog("made up", odometry, np.array(rows), truth, BEACONS_M, 0)


def test_trunks_are_percepts_without_a_name_from_where_the_pose_is() -> None:
    first, *_ = trees.moments(_tree_log(noise=0.0))

    (percept, *_) = first.percepts
    assert (percept.name, percept.label) == ("", "")
    assert percept.width_m == pytest.approx(0.4)
    at_m = percept.range_m * np.array([np.cos(percept.bearing_rad), np.sin(percept.bearing_rad)])
    pose = _circle()[5]
    turn = np.array([[np.cos(pose[3]), -np.sin(pose[3])], [np.sin(pose[3]), np.cos(pose[3])]])
    assert pose[1:3] + turn @ at_m == pytest.approx(TREES_M[0], abs=1e-6)


def test_self_motion_between_moments_adds_up_to_the_log() -> None:
    of_trees = np.vstack([moment.motions for moment in trees.moments(_tree_log())])
    of_beacons = np.vstack([moment.motions for moment in beacons.moments(_range_log(0.0))])

    for rows in (of_trees, of_beacons):
        turned_rad = (rows[:, 1] * rows[:, 2]).sum()
        assert turned_rad == pytest.approx(TURN_RATE_RAD_S * LASTS_S, rel=0.02)
        assert (rows[:, 2] > 0).all()


def test_a_beacon_is_heard_at_a_range_in_no_direction() -> None:
    heard = [percept for moment in beacons.moments(_range_log(0.0)) for percept in moment.percepts]

    assert {percept.label for percept in heard} == {"beacon-1", "beacon-5", "beacon-6"}
    assert all(percept.has_range and not percept.has_bearing for percept in heard)


def test_without_names_percepts_say_only_where_something_stands() -> None:
    named = list(beacons.moments(_range_log(0.0)))[:20]
    nameless = list(without_names(named))

    for before, after in zip(named, nameless, strict=True):
        assert [each.label for each in after.percepts] == [""] * len(before.percepts)
        assert [each.range_m for each in after.percepts] == [
            each.range_m for each in before.percepts
        ]


def test_gtsam_with_nearest_neighbours_finds_as_many_landmarks_as_there_are_trees() -> None:
    pytest.importorskip("gtsam")
    peer = NearestNeighbour()
    sensed = list(trees.moments(_tree_log()))
    for moment in sensed:
        peer.add(moment)

    stamps_s = np.array([each.stamp_s for each in sensed])
    every = _circle()
    truth = every[(every[:, 0] >= stamps_s[0]) & (every[:, 0] <= stamps_s[-1])]
    found_m = gps.at_fixes(stamps_s, peer.path(), truth)
    assert peer.landmarks == len(TREES_M)
    assert gps.errors_m(found_m, truth[:, 1:3]).max() < 0.3


def test_gtsams_batch_by_ranges_finds_their_gain() -> None:
    pytest.importorskip("gtsam")
    sensed = list(beacons.moments(_range_log(0.1)))
    shares: list[float] = []

    plain_m, calibrated_m = range_batch.solve(sensed, shares.append)

    truth = _circle()
    stamps_s = np.array([each.stamp_s for each in sensed])
    true_m = gps.at_fixes(
        truth[:, 0], truth[:, 1:], np.column_stack([stamps_s, stamps_s, stamps_s])
    )
    assert gps.errors_m(calibrated_m, true_m).mean() < gps.errors_m(plain_m, true_m).mean()
    assert gps.errors_m(calibrated_m, true_m).mean() < 0.3
    assert shares[-1] == 1.0


def test_jumps_of_gps_neither_turn_the_alignment_nor_count() -> None:
    truth_m = _circle()[:, 1:3]
    turned_m = truth_m @ np.array([[0.6, 0.8], [-0.8, 0.6]]) + (30.0, -5.0)
    jumping_m = truth_m.copy()
    jumping_m[100:130] += (15.0, 5.0)

    errors_m = gps.errors_m(turned_m, jumping_m)

    is_jump = gps.are_jumps([errors_m, errors_m + 1.0])
    assert np.flatnonzero(is_jump).tolist() == list(range(100, 130))
    assert errors_m[~is_jump].max() < 0.1


def test_an_antenna_ahead_of_the_pose_is_where_the_heading_leads() -> None:
    path = np.array([[0.0, 0.0, np.pi / 2], [10.0, 0.0, np.pi / 2]])
    fixes = np.array([[0.5, 7.0, 7.0]])

    (at_m,) = gps.at_fixes(np.array([0.0, 1.0]), path, fixes, antenna_m=(4.0, 1.0))

    assert at_m == pytest.approx([4.0, 4.0])
