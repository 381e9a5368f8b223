"""Logs of landmarks become views, with what the wheels did in between."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from cogmap.data.true_path import poses_at
from cogmap.errors import ConfigError, UsageError
from cogmap.schemas.sensing import Percepts, RangeScan, SelfMotion
from cogmap.services.player.config import Config
from cogmap.services.player.formats import opened
from cogmap.services.player.landmark_logs.views import (
    LandmarkLog,
    check_landmarks,
    view_stamps,
)
from cogmap.services.player.recording import LEAD_NS, poses_of
from cogmap.testing import of_type
from tests.support.recordings import mrclam_folder


def _mrclam(folder: Path, robot: int = 1) -> LandmarkLog:
    log = opened(Config(recording=f"mrclam:{folder}", robot=robot))
    assert isinstance(log, LandmarkLog)
    return log


def test_there_is_a_view_of_what_was_seen_at_once_and_one_where_nothing_was_for_long() -> None:
    stamps_s, view_of = view_stamps(np.array([10.1, 10.101, 10.55]), 10.0, 11.0)

    assert stamps_s == pytest.approx([10.0, 10.1, 10.3, 10.55, 10.75])
    assert view_of.tolist() == [1, 1, 3]


def test_what_is_seen_at_the_very_beginning_belongs_to_the_first_view() -> None:
    stamps_s, view_of = view_stamps(np.array([10.0, 10.1]), 10.0, 10.1)

    assert stamps_s == pytest.approx([10.0, 10.1])
    assert view_of.tolist() == [0, 1]


def test_truth_is_not_invented_in_a_gap_nor_outside_of_it() -> None:
    truth = np.array([[1.0, 0.0, 0.0, 3.1], [1.2, 2.0, 0.0, -3.1], [9.0, 5.0, 5.0, 0.0]])

    before, known, gap, after = poses_of(poses_at(truth, np.array([0.9, 1.1, 5.0, 9.1])))

    assert before is None
    assert gap is None
    assert after is None
    assert known is not None
    assert known.x_m == pytest.approx(1.0)
    assert np.cos(known.heading_rad) == pytest.approx(-1.0, abs=0.01)


def test_an_mrclam_robot_sees_its_landmarks_by_name_and_moves_as_it_was_commanded(
    tmp_path: Path,
) -> None:
    log = _mrclam(mrclam_folder(tmp_path))
    views = [log.view(number) for number in range(len(log.stamps_ns))]
    messages = [message for view in views for message in view]

    assert log.stamps_ns[0] == LEAD_NS
    seen = [percept for view in of_type(Percepts, messages) for percept in view.objects]
    assert [percept.label for percept in seen] == ["landmark-6", "landmark-7"] * 3
    assert seen[0].range_m == pytest.approx(2.0 / np.cos(0.2)), "it was the depth"

    rows = np.vstack([np.asarray(each.motions.numpy()) for each in of_type(SelfMotion, messages)])
    assert float((rows[:, 0] * rows[:, 2]).sum()) == pytest.approx(0.5 * 1.78)
    assert all(scan.range_m.shape == (0,) for scan in of_type(RangeScan, messages))


def test_barcodes_that_nothing_has_are_left_out_and_counted(tmp_path: Path) -> None:
    assert _mrclam(mrclam_folder(tmp_path)).notes == []

    log = _mrclam(mrclam_folder(tmp_path, barcodes=[63, 25, 99, 5]))

    assert sum(len(percepts) for percepts in log.percepts) == 6
    assert log.notes == [
        "3 observations of barcodes that nothing has are left out",
        "3 observations of other robots are left out",
    ]


def test_self_motion_leads_from_view_to_view(tmp_path: Path) -> None:
    log = _mrclam(mrclam_folder(tmp_path))

    motions = of_type(SelfMotion, [log.view(number)[0] for number in range(3)])

    assert [each.since_ns for each in motions] == [log.stamps_ns[0], *log.stamps_ns[:2]]


def test_observers_are_told_where_the_landmarks_really_are(tmp_path: Path) -> None:
    town = _mrclam(mrclam_folder(tmp_path)).town()

    assert town is not None
    assert [building.name for building in town.buildings] == ["landmark-6", "landmark-7"]


def test_a_robot_that_the_set_lacks_is_said(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="has the robots 1, choose one"):
        _mrclam(mrclam_folder(tmp_path), robot=4)


def test_a_log_whose_landmarks_are_all_one_is_said(tmp_path: Path) -> None:
    folder = mrclam_folder(tmp_path, barcodes=[63, 63])

    with pytest.raises(UsageError, match="all its observations are of one barcode"):
        _mrclam(folder)


def test_a_log_without_observations_is_said() -> None:
    with pytest.raises(UsageError, match="no tree was observed"):
        check_landmarks([], Path("log"), "tree")


def _csv(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        (folder / f"{name}.csv").write_text(text)
    return folder


def _trees(folder: Path, seen: str) -> LandmarkLog:
    odometry = "".join(f"{tick / 10},2.0,0.0\n" for tick in range(101))
    gps = "".join(f"{tick / 5},{5.0 + tick / 5 * 2.0},7.0\n" for tick in range(51))
    _csv(
        folder,
        odometry=f"t_s,speed_m_s,turn_rate_rad_s\n{odometry}",
        trees=f"t_s,range_m,bearing_rad,diameter_m\n{seen}",
        gps=f"t_s,x_m,y_m\n{gps}",
    )
    log = opened(Config(recording=f"trees:{folder}"))
    assert isinstance(log, LandmarkLog)
    return log


def test_trees_are_seen_from_the_axle_without_a_name_and_with_their_diameter(
    tmp_path: Path,
) -> None:
    log = _trees(tmp_path, "2.0,10.0,0.0,0.4\n2.0,5.0,0.5,0.9\n")
    (view,) = [number for number, percepts in enumerate(log.percepts) if percepts]
    first, second = log.percepts[view]

    assert log.stamps_ns[view] - log.stamps_ns[0] == 2_000_000_000
    assert {first.label, second.label} == {""}
    assert first.range_m == pytest.approx(np.hypot(13.78, 0.5))
    assert first.bearing_rad == pytest.approx(np.arctan2(0.5, 13.78))
    assert (first.width_m, second.width_m) == (0.4, 0.9)
    driven_m = sum(float((rows[:, 0] * rows[:, 2]).sum()) for rows in log.motions)
    assert driven_m == pytest.approx(2.0 * 9.8, abs=0.2)


def test_satellites_give_a_heading_only_where_the_car_drives(tmp_path: Path) -> None:
    log = _trees(tmp_path, "2.0,10.0,0.0,0.4\n2.0,5.0,0.5,0.9\n")

    poses = [pose for pose in log.true_poses if pose is not None]
    assert poses[0].heading_rad == pytest.approx(0.0)
    assert log.true_poses[0] is None, "nobody knows whence it came"
    assert {round(pose.y_m, 6) for pose in poses} == {7.0}


def test_a_log_of_one_trunk_over_and_over_is_said(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="every line is of one trunk"):
        _trees(tmp_path, "2.0,10.0,0.0,0.4\n3.0,10.0,0.0,0.4\n")


def _ranges(folder: Path, beacons: Sequence[int]) -> LandmarkLog:
    odometry = "".join(f"{tick / 10},0.1,0.02\n" for tick in range(51))
    truth = "".join(f"{tick / 10},{tick / 10},0.0,0.0\n" for tick in range(51))
    seen = "".join(f"{1.0 + each},{number},{30.0 + each}\n" for each, number in enumerate(beacons))
    _csv(
        folder,
        odometry=f"t_s,distance_m,turn_rad\n{odometry}",
        ranges=f"t_s,beacon,range_m\n{seen}",
        truth=f"t_s,x_m,y_m,heading_rad\n{truth}",
        beacons="beacon,x_m,y_m\n4,30.0,5.0\n7,-10.0,5.0\n",
    )
    log = opened(Config(recording=f"ranges:{folder}"))
    assert isinstance(log, LandmarkLog)
    return log


def test_ranges_are_percepts_whose_bearing_nobody_knows(tmp_path: Path) -> None:
    log = _ranges(tmp_path, [4, 7, 4])
    seen = [percept for percepts in log.percepts for percept in percepts]

    assert [percept.label for percept in seen] == ["beacon-4", "beacon-7", "beacon-4"]
    assert [percept.range_m for percept in seen] == [30.0, 31.0, 32.0]
    assert not any(percept.has_bearing for percept in seen)
    assert all(percept.has_range for percept in seen)
    rows = np.vstack(log.motions)
    assert rows[1:, 0] == pytest.approx(1.0), "0.1 m in 0.1 s"
    assert rows[1:, 1] == pytest.approx(0.2)


def test_observations_that_came_late_are_put_in_order_and_counted(tmp_path: Path) -> None:
    log = _trees(tmp_path, "3.0,10.0,0.0,0.4\n2.0,5.0,0.5,0.9\n")

    assert log.notes == ["1 observations came late, and were put in order"]
    assert [len(percepts) for percepts in log.percepts if percepts] == [1, 1]


def test_ranges_to_one_beacon_alone_are_said(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="all its observations are of one beacon"):
        _ranges(tmp_path, [4, 4])
