"""`cogmap sweep`: what its options mean, and what it prints of drives that are there already."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from cogmap.cli.run.script import DriveOptions
from cogmap.cli.sweep.command import sweep_command
from cogmap.cli.sweep.execution import STEPPED_LIMIT_S
from cogmap.cli.sweep.plan import left_to_drive, plan
from cogmap.errors import CogmapError
from tests.support.world.summaries import summary, write_summary

VARIANTS = [{"sim.sensing": word} for word in ("percepts", "images")]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A sweep whose drives are all there: the last of them failed."""
    options: DriveOptions = {"lockstep": True, "time_limit_s": STEPPED_LIMIT_S}
    drives = plan(tmp_path, [1, 2], VARIANTS, {"sim.duration_s": 5}, options)
    left_to_drive(tmp_path, drives)
    for number, drive in enumerate(drives, start=1):
        write_summary(drive.folder, summary(mean_m=float(number)))
    write_summary(
        drives[-1].folder,
        summary(completed=False, ended_by="stuck", reason="it stayed [there]"),
    )
    return tmp_path


def called(folder: Path, *arguments: str) -> Result:
    usual = ["--seeds", "1-2", "--set", "sim.duration_s=5", "--out", str(folder)]
    return CliRunner().invoke(sweep_command, [*usual, *arguments])


def test_it_prints_a_row_a_drive_and_the_statistics_of_each_variant(folder: Path) -> None:
    result = called(folder, "--vary", "sim.sensing=percepts,images")

    assert result.exit_code == 1
    lines = result.stdout.splitlines()
    failed = next(line for line in lines if "stuck" in line)
    mean = next(line for line in lines if "mean" in line and "percepts" in line)
    assert "sim.sensing=images" in failed
    assert "stuck: it stayed [there]" in failed
    assert " 1.500 " in mean
    assert lines[-1] == f"4 drives in {folder}, 1 of them failed"


def test_it_ends_with_0_where_no_drive_failed(folder: Path) -> None:
    assert called(folder, "--vary", "sim.sensing=percepts").exit_code == 0


def test_json_and_csv_have_every_figure(folder: Path) -> None:
    path = folder / "drives.csv"
    result = called(folder, "--vary", "sim.sensing=percepts", "--json", "--csv", str(path))

    printed = json.loads(result.stdout)
    assert [row["estimate.mean_m"] for row in printed["drives"]] == [1.0, 2.0]
    assert printed["statistics"][0]["mean"]["estimate.max_m"] == 3.0
    assert path.read_text().startswith("seed,sim.sensing,folder,")


@pytest.mark.parametrize(
    ("option", "value", "sentence"),
    [
        ("--seeds", "1-x", "write seeds and ranges"),
        ("--vary", "sim.sensing", "write it as module.key=value,value"),
        ("--csv", "nowhere/drives.csv", "there is no folder nowhere"),
    ],
)
def test_an_option_that_makes_no_sense_is_named(
    folder: Path, option: str, value: str, sentence: str
) -> None:
    result = called(folder, option, value)

    assert isinstance(result.exception, CogmapError)
    assert sentence in str(result.exception)
