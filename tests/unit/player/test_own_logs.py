"""What the body of a recorded run published is played again, and nothing else of it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from msgspec.structs import replace

from cogmap.bus.codec import encode
from cogmap.errors import LogError
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Odometry, Percepts, Pose, TruePose
from cogmap.services.player.config import Config
from cogmap.services.player.own_logs import OwnLog, opened
from cogmap.testing import odometry, percepts, range_scan, self_motion, stamp_ns
from tests.support.logs import write_log

CONFIG = {
    "run": {"energy": True},
    "sim": {"seed": 7},
    "sensory": {"speed_noise": 0.2},
    "codelets": {"samples": 500},
    "workspace": {"goals": [{"name": "home", "x_m": 0.0, "y_m": 0.0}]},
}


def _log(path: Path, *messages: Message) -> OwnLog:
    rows = [(1000 * (number + 1), message) for number, message in enumerate(messages)]
    return opened(write_log(path / "log.mcap", rows, config=json.dumps(CONFIG)), Config())


def _by(source: str, message: Message, seq: int = 0) -> Message:
    return replace(message, source=source, seq=seq)


def _view(frame: int, source: str = "sim") -> list[Message]:
    pose = Pose(x_m=frame, y_m=0.0, heading_rad=0.0)
    true = TruePose(stamp_ns=stamp_ns(frame), pose=pose, travelled_m=frame, progress=0.5)
    every = [true, self_motion(frame), range_scan((0.0, 5.0), frame=frame), percepts(frame)]
    return [_by(source, message, frame) for message in every]


def test_views_come_again_with_what_was_sensed_beside_them_and_the_truth(tmp_path: Path) -> None:
    log = _log(tmp_path, *_view(0), *_view(1))

    assert log.stamps_ns == [stamp_ns(0), stamp_ns(1)]
    assert [type(each).__name__ for each in log.before(1)] == ["SelfMotion", "RangeScan"]
    assert encode(log.view(1)[0]) == encode(_view(1)[-1])
    assert [pose and pose.x_m for pose in log.true_poses] == [0.0, 1.0]
    assert log.town() is None


def test_what_other_modules_published_is_not_sensed_again(tmp_path: Path) -> None:
    of_epam = _by("epam", percepts(0))
    of_others = _by("stranger", odometry(stamp_ns=stamp_ns(0)))
    log = _log(tmp_path, of_epam, of_others, *_view(1))

    assert log.stamps_ns == [stamp_ns(1)]
    assert all(not isinstance(each, Odometry) for each in log.before(0))


def test_a_view_that_was_published_again_is_played_once(tmp_path: Path) -> None:
    log = _log(tmp_path, *_view(0), *_view(0), *_view(1))

    assert log.stamps_ns == [stamp_ns(0), stamp_ns(1)]


def test_the_log_of_a_recording_can_be_played_too(tmp_path: Path) -> None:
    log = _log(tmp_path, *_view(0, "player"))

    assert isinstance(log.view(0)[0], Percepts)


def test_the_senses_are_set_as_they_were_and_the_mind_is_not(tmp_path: Path) -> None:
    settings = _log(tmp_path, *_view(0)).settings

    assert settings == {
        "run": {"energy": True},
        "sensory": {"speed_noise": 0.2},
        "codelets": {"samples": 500},
    }


def test_a_log_without_views_is_said(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="record a whole drive"):
        _log(tmp_path, _by("sim", odometry()))


def test_a_file_that_is_no_log_is_said(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(b"no log")

    with pytest.raises(LogError, match=r"log\.mcap"):
        opened(path, Config())
