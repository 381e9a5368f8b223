"""What a sweep found, as a table, as CSV and as statistics."""

from __future__ import annotations

import csv
from io import StringIO
from pathlib import Path

import pytest

from cogmap.cli.sweep.result import Sweep, SweptDrive
from tests.support.world.summaries import summary


def swept(seed: int, mean_m: float | None, error: str = "", **settings: object) -> SweptDrive:
    metrics = None if mean_m is None else summary(mean_m, seed=seed, completed=not error)
    return SweptDrive(seed, settings, Path(f"seed-{seed}"), metrics, error)


@pytest.fixture
def found() -> Sweep:
    drives = [
        swept(1, 1.0),
        swept(2, 2.0),
        swept(3, 9.0, "stuck: behind a wall"),
        swept(1, 4.0, speed=3),
        swept(2, None, "the disk is full", speed=3),
    ]
    return Sweep(Path("sweep"), drives)


def test_means_and_deviations_are_of_the_drives_that_did_not_fail(found: Sweep) -> None:
    usual, fast = found.statistics()

    assert (usual.settings, usual.drives) == ({}, 2)
    assert usual.mean["estimate.mean_m"] == 1.5
    assert usual.sd["estimate.mean_m"] == pytest.approx(0.5**0.5)
    assert (fast.settings, fast.drives) == ({"speed": 3}, 1)
    assert fast.mean["estimate.max_m"] == 8.0
    assert fast.sd["estimate.max_m"] is None


def test_no_mean_is_of_words_of_answers_or_of_what_was_not_measured(found: Sweep) -> None:
    mean = found.statistics()[0].mean

    assert not {"ended_by", "completed", "wheels_alone.mean_m"} & mean.keys()


def test_the_drives_that_failed_are_named(found: Sweep) -> None:
    assert [drive.error for drive in found.failed] == ["stuck: behind a wall", "the disk is full"]


def test_a_table_has_a_row_a_drive(found: Sweep) -> None:
    table = found.table()

    assert table["seed"].to_pylist() == [1, 2, 3, 1, 2]
    assert table["speed"].to_pylist() == [None, None, None, 3, 3]
    assert table["estimate.mean_m"].to_pylist() == [1.0, 2.0, 9.0, 4.0, None]


def test_csv_has_the_same(found: Sweep) -> None:
    rows = list(csv.DictReader(StringIO(found.csv())))

    assert [row["estimate.mean_m"] for row in rows] == ["1.0", "2.0", "9.0", "4.0", ""]
    assert rows[-1]["error"] == "the disk is full"
