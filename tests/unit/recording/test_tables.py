"""A log as files of tables, read back by their own reader."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from pyarrow import csv, parquet

from cogmap.cli.main import cogmap
from cogmap.errors import LogError, UsageError
from cogmap.recording import open_log
from cogmap.recording.exporting import tables
from cogmap.recording.exporting.tables import TableFormat, write_tables
from cogmap.recording.selection import named
from cogmap.schemas import topics
from tests.support.reference import REFERENCE


def test_parquet_gives_back_every_row_of_every_topic(tmp_path: Path) -> None:
    log = open_log(REFERENCE)
    rows = write_tables(log, tmp_path / "out", TableFormat.PARQUET, named(log.topics))

    assert rows["camera/stereo"] > 0
    for name, count in rows.items():
        path = tmp_path / "out" / f"{topics.BY_NAME[name].file_stem}.parquet"
        table = parquet.read_table(path)
        assert table.num_rows == count
        assert table.equals(log.frame(name))


def test_csv_gives_back_every_row_and_has_no_images(tmp_path: Path) -> None:
    log = open_log(REFERENCE)
    rows = write_tables(log, tmp_path / "out", TableFormat.CSV, named(log.topics))

    assert "camera/stereo" not in rows
    poses = csv.read_csv(tmp_path / "out" / "truth.pose.csv")
    assert poses["pose.x_m"].to_pylist() == log.frame("truth/pose")["pose.x_m"].to_pylist()
    percepts = csv.read_csv(tmp_path / "out" / "epam.percepts.csv")
    objects = json.loads(percepts["objects"].to_pylist()[-1])
    assert len(objects) == len(log.frame("epam/percepts")["objects"].to_pylist()[-1])


def test_a_file_is_written_in_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "SPAN_S", 0.1)
    log = open_log(REFERENCE)
    shares: list[float] = []
    write_tables(log, tmp_path / "out", TableFormat.PARQUET, [topics.ODOMETRY], shares.append)

    table = parquet.read_table(tmp_path / "out" / "odometry.parquet")
    assert table.equals(log.frame("odometry"))
    assert len(shares) > 5
    assert shares == sorted(shares)
    assert shares[-1] <= 1.0


def test_a_folder_that_exists_is_left_alone(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="exists already"):
        write_tables(open_log(REFERENCE), tmp_path, TableFormat.CSV, [topics.ODOMETRY])


def exported(*words: str | Path) -> str:
    """What the command prints. Raises what it raises."""
    arguments = ["log", "export", *map(str, words)]
    result = CliRunner().invoke(cogmap, arguments, standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result.stdout


def test_the_command_says_how_many_rows_each_topic_has(tmp_path: Path) -> None:
    said = json.loads(
        exported(
            REFERENCE, "odometry", "--csv", tmp_path / "a", "--parquet", tmp_path / "b", "--json"
        )
    )

    count = open_log(REFERENCE).frame("odometry").num_rows
    assert said == {
        str(tmp_path / "a"): {"odometry": count},
        str(tmp_path / "b"): {"odometry": count},
    }


def test_without_a_format_and_without_a_log_the_remedy_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="--csv DIR"):
        exported(REFERENCE)
    with pytest.raises(LogError, match="no log"):
        exported(tmp_path / "none.mcap", "--csv", tmp_path / "out")
    with pytest.raises(UsageError, match="did you mean 'odometry'"):
        exported(REFERENCE, "odometri", "--csv", tmp_path / "out")
