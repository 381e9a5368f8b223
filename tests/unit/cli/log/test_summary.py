"""The summary and the map of a drive, from its log alone."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cogmap.errors import UsageError
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Odometry, Pose, TruePose
from cogmap.testing import odometry
from tests.support.logs import SECOND_NS, write_log
from tests.support.system.commands import log_command, log_facts

STEPS = 5


def true_pose(seq: int) -> TruePose:
    return TruePose(
        stamp_ns=seq * SECOND_NS,
        seq=seq,
        source="sim",
        pose=Pose(x_m=float(seq), y_m=0.0, heading_rad=0.0),
        travelled_m=float(seq),
        progress=seq / STEPS,
    )


def turn_of_wheels(seq: int) -> Odometry:
    return odometry(seq, stamp_ns=seq * SECOND_NS, dt_s=1.0)


def write(path: Path, messages: list[Message], config: str = "{}") -> Path:
    rows = [(message.stamp_ns, message) for message in messages]
    return write_log(path, rows, config=config)


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """A robot that drives straight for five seconds, with wheels that measure it so."""
    messages: list[Message] = []
    for seq in range(STEPS + 1):
        messages.append(true_pose(seq))
        messages.append(turn_of_wheels(seq))

    config = json.dumps({"sim": {"seed": 7}, "run": {"lockstep": True}})
    return write(tmp_path / "drive.mcap", messages, config)


def test_a_summary_has_the_drive_and_its_settings(drive: Path) -> None:
    found = log_facts("summary", drive)

    assert found["seed"] == 7
    assert found["lockstep"]
    assert found["drive_s"] == 5.0
    assert found["distance_m"] == 5.0
    assert found["completed"]
    assert found["gaps_total"] == 0
    assert found["log"] is None


def test_a_summary_is_a_table_for_people(drive: Path) -> None:
    shown = log_command("summary", drive).stdout

    assert "5.0 m in 5.0 s" in shown
    assert "path integration alone, wheels" in shown
    assert "the recording was not finished" in shown


def test_settings_that_a_log_lacks_are_the_defaults(tmp_path: Path) -> None:
    log = write(tmp_path / "bare.mcap", [true_pose(0)])
    found = log_facts("summary", log)

    assert found["seed"] == 1
    assert not found["lockstep"]


def test_a_log_without_true_poses_is_said_to_have_none(tmp_path: Path) -> None:
    blind = write(tmp_path / "blind.mcap", [turn_of_wheels(0)])
    result = log_command("summary", blind, "--json")

    assert "holds no truth/pose: distances and errors are 0" in result.stderr
    assert json.loads(result.stdout)["distance_m"] == 0.0


def test_a_map_is_drawn_as_an_image_named_by_its_log(
    drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    assert "drive-map.png: 5 m of driving" in log_command("map", drive).stdout
    assert (tmp_path / "drive-map.png").read_bytes().startswith(b"\x89PNG")


def test_a_map_can_be_a_pdf(drive: Path, tmp_path: Path) -> None:
    log_command("map", drive, "-o", tmp_path / "town.pdf")

    assert (tmp_path / "town.pdf").read_bytes().startswith(b"%PDF")


def test_a_map_that_cannot_be_written_is_one_sentence(drive: Path, tmp_path: Path) -> None:
    absent = tmp_path / "absent"

    with pytest.raises(UsageError, match=r"name a file that ends in \.png or \.pdf"):
        log_command("map", drive, "-o", "town.txt")
    with pytest.raises(UsageError, match="make it first"):
        log_command("map", drive, "-o", absent / "town.png")
