"""The errors of an agent's pose, read from a log."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from click.testing import CliRunner
from msgspec import structs

from cogmap.cli.launch.drive_metrics import RecordedMetrics
from cogmap.cli.log.summary import summary
from cogmap.errors import LogError
from cogmap.recording import open_log
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from tests.support.logs import SECOND_NS, write_log
from tests.support.reference import REFERENCE
from tests.support.world.paths import TICK_NS, estimate, odometry, self_motion, true_pose


def write(path: Path, *messages: Message) -> Path:
    """A log of these messages, a second apart."""
    timed = [(SECOND_NS * (100 + number), one) for number, one in enumerate(messages)]
    return write_log(path, timed)


def test_a_row_has_the_errors_of_an_estimate_and_of_path_integration(tmp_path: Path) -> None:
    path = write(
        tmp_path / "log.mcap",
        true_pose(0, 5.0, 0.0),
        odometry(1, 3.0),
        self_motion(1, 2.0),
        true_pose(1, 5.05, 0.0),
        estimate(1, 0.05, 0.3, heading_rad=-0.1),
        estimate(1, 0.05, 0.2, version=2, heading_rad=-0.1),
    )

    (row,) = open_log(path).errors().to_pylist()

    assert (row["time_s"], row["stamp_ns"]) == (4.0, TICK_NS)
    assert (row["x_m"], row["y_m"], row["heading_rad"]) == (5.05, 0.0, 0.0)
    assert row["estimate_m"] == pytest.approx(0.2)
    assert row["estimate_rad"] == pytest.approx(-0.1)
    assert row["fused_m"] == pytest.approx(0.05)
    assert row["wheels_m"] == pytest.approx(0.1)


def test_the_errors_are_those_of_the_summary() -> None:
    printed = CliRunner().invoke(summary, [str(REFERENCE), "--json"]).stdout
    metrics = msgspec.json.decode(printed, type=RecordedMetrics)
    errors = open_log(REFERENCE).errors()

    assert errors.num_rows == metrics.estimates > 0
    assert np.mean(errors["estimate_m"].to_numpy()) == metrics.estimate.mean_m
    assert np.max(errors["fused_m"].to_numpy()) == metrics.fused_alone.max_m
    assert errors["wheels_m"].to_pylist()[-1] == metrics.wheels_alone.final_m


def test_wheels_that_publish_nothing_have_no_column(tmp_path: Path) -> None:
    path = write(tmp_path / "log.mcap", true_pose(0, 0.0, 0.0), self_motion(1, 2.0))

    assert open_log(path).errors().column_names[-1] == "fused_rad"


def test_a_log_without_truth_is_named(tmp_path: Path) -> None:
    path = write(tmp_path / "log.mcap", self_motion(1, 1.0), estimate(1, 0.0, 0.0))

    with pytest.raises(LogError, match=r"log\.mcap holds no truth/pose: errors need a drive"):
        open_log(path).errors()


def test_a_log_of_the_end_of_a_drive_is_named(tmp_path: Path) -> None:
    path = write(tmp_path / "log.mcap", true_pose(0, 0.0, 0.0), estimate(1, 0.0, 0.0, version=7))

    with pytest.raises(LogError, match=r"begins with delta 7, in the middle of a drive"):
        open_log(path).errors()


def test_self_motion_that_makes_no_sense_is_named(tmp_path: Path) -> None:
    bad = structs.replace(self_motion(1, 1.0), motions=Array.of([[1.0]], "<f8"))
    path = write(tmp_path / "log.mcap", true_pose(0, 0.0, 0.0), bad)

    with pytest.raises(LogError, match=r"self-motion of shape \(1, 1\)"):
        open_log(path).errors()
