"""A drive that left as a bag of ROS comes back as it was sensed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cogmap.recording import open_log
from cogmap.recording.exporting.rosbag2 import write_rosbag2
from cogmap.schemas.base import Message
from cogmap.schemas.process import Playback
from cogmap.schemas.sensing import (
    Odometry,
    Percepts,
    Pose,
    RangeScan,
    SelfMotion,
    StereoFrame,
)
from cogmap.services.player import formats
from cogmap.services.player.config import Config
from cogmap.services.player.own_logs import OwnLog
from cogmap.services.player.playhead import Playhead
from cogmap.services.player.recording import LEAD_NS, Recording
from tests.support import bags
from tests.support.bags import BagMaker, cameras, frame_ns, frames, wheels
from tests.support.reference import REFERENCE


def _opened(path: Path) -> Recording:
    return formats.opened(Config(recording=f"bag:{path}"))


def _odometry(messages: list[Message]) -> list[Odometry]:
    return [each for each in messages if isinstance(each, Odometry)]


def _moved(messages: list[Odometry], first_ns: int) -> list[list[float]]:
    """When motions end, since the first frame, and what they are."""
    return [
        [(each.stamp_ns - first_ns) / 1e9, each.speed_m_s, each.turn_rate_rad_s, each.dt_s]
        for each in messages
    ]


def test_a_log_that_was_exported_is_sensed_as_it_was(tmp_path: Path) -> None:
    write_rosbag2(open_log(REFERENCE), tmp_path / "bag")
    log = OwnLog(REFERENCE)
    bag = _opened(tmp_path / "bag")

    assert len(bag.stamps_ns) == len(log.stamps_ns)
    assert np.diff(bag.stamps_ns).tolist() == np.diff(log.stamps_ns).tolist()
    for number in range(len(log.stamps_ns)):
        (ours,) = log.view(number)
        (theirs,) = bag.view(number)
        assert isinstance(ours, StereoFrame)
        assert isinstance(theirs, StereoFrame)
        assert (theirs.left, theirs.right) == (ours.left, ours.right)
        assert theirs.calibration.right_rotation_rad == pytest.approx(
            ours.calibration.right_rotation_rad
        )
        moved = _moved(_odometry(log.before(number)), log.stamps_ns[0])
        came_back = _moved(_odometry(bag.before(number)), bag.stamps_ns[0])
        assert np.allclose(came_back, moved, rtol=0, atol=1e-9)


def test_odometry_goes_on_until_each_frame(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "drive.bag", ros=1) as maker:
        cameras(maker)
        frames(maker)
        wheels(maker)

    recording = _opened(tmp_path / "drive.bag")

    assert recording.settings == {}
    assert recording.stamps_ns[0] == LEAD_NS
    for number, stamp_ns in enumerate(recording.stamps_ns):
        moved = _odometry(recording.before(number))
        assert moved[-1].stamp_ns == stamp_ns
        assert sum(each.dt_s for each in moved) == pytest.approx(0.2)
        assert all(each.speed_m_s == pytest.approx(1.0) for each in moved)


def test_frames_that_odometry_does_not_lead_to_are_left_out_and_counted(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker, range(8))
        wheels(maker, until_s=1.0)

    recording = _opened(tmp_path / "bag")

    assert len(recording.stamps_ns) == 5
    assert recording.notes == ["3 images from before or after the odometry are left out"]


def test_motion_from_long_before_the_first_frame_is_not_sensed(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker, range(20, 22))
        wheels(maker, until_s=5.0)

    moved = _odometry(_opened(tmp_path / "bag").before(0))

    assert sum(each.dt_s for each in moved) == pytest.approx(LEAD_NS / 1e9)


def test_without_odometry_views_tell_the_self_motion(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker)

    recording = _opened(tmp_path / "bag")

    assert recording.settings == {"sensory": {"self_motion": "views"}}
    assert recording.before(1) == []
    poses: list[Pose | None] = [None] * 4
    assert recording.true_poses == poses


def test_an_image_that_cannot_be_decoded_is_left_out_and_counted(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker, (0, 2))
        maker.image(bags.LEFT, frame_ns(1), bags.WALL[:, :32], encoding="rgb8")
        maker.image(bags.RIGHT, frame_ns(1), bags.WALL)
    playhead = Playhead(_opened(tmp_path / "bag"), "bag")

    playhead.advance()
    step = playhead.advance()

    assert step is not None
    (played,) = step.truth
    assert isinstance(played, Playback)
    assert (played.views, played.skipped) == (2, 1)
    assert "cannot be decoded" in played.reasons[0]


def test_a_laser_without_a_pair_of_cameras_is_played_as_range_scans(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        wheels(maker)
        maker.image("/camera/image_raw", frame_ns(0), bags.WALL)
        for number in range(4):
            maker.scan(frame_ns(number), [2.0] * 90)

    recording = _opened(tmp_path / "bag")

    assert len(recording.stamps_ns) == 4
    motion, scan, percepts = recording.view(1)
    assert isinstance(motion, SelfMotion)
    assert isinstance(scan, RangeScan)
    assert isinstance(percepts, Percepts)
    rows = motion.motions.numpy()
    assert rows[:, 0] == pytest.approx(1.0)
    assert rows[:, 2].sum() == pytest.approx(0.2)
    assert np.unique(scan.range_m.numpy()).tolist() == [2.0]
    assert percepts.objects == []
    assert recording.notes == ["the images on /camera/image_raw are no pair, and are left out"]


def test_beside_a_pair_of_cameras_a_laser_is_left_out(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker)
        maker.scan(frame_ns(0), [2.0] * 90)

    recording = _opened(tmp_path / "bag")

    assert isinstance(recording.view(0)[0], StereoFrame)
    assert recording.notes == ["the scans on /scan are left out: depth gives range scans"]
