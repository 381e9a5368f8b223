"""Logs of landmarks become views, with what the wheels did in between."""

from __future__ import annotations

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

    assert stamps_s == pytest.approx([10.0, 10.1, 10.3, 10.5, 10.55, 10.75, 10.95])
    assert view_of.tolist() == [1, 1, 4]


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
    assert float((rows[:, 0] * rows[:, 2]).sum()) == pytest.approx(0.5 * 1.9)
    assert all(scan.range_m.shape == (0,) for scan in of_type(RangeScan, messages))


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
