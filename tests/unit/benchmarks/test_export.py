"""What the benchmark of exports counts as lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyarrow import parquet

from benchmarks.export.measure import FORMATS
from benchmarks.export.round_trips import lost_in_bag, lost_in_csv, lost_in_parquet
from cogmap.recording import open_log
from cogmap.recording.exporting.tables import TableFormat, write_tables
from cogmap.schemas import topics
from tests.support.bags import BagMaker, cameras, frames
from tests.support.reference import REFERENCE


@pytest.mark.parametrize("name", FORMATS)
def test_nothing_of_the_reference_drive_is_lost(name: str, tmp_path: Path) -> None:
    if name == "rerun":
        pytest.importorskip("rerun")
    write, lost_in = FORMATS[name]
    log = open_log(REFERENCE)
    write(log, tmp_path / name)

    assert lost_in(log, tmp_path / name) == 0


def test_a_row_that_is_missing_is_counted(tmp_path: Path) -> None:
    log = open_log(REFERENCE)
    for kind in TableFormat:
        write_tables(log, tmp_path / kind.value, kind, [topics.ODOMETRY])
    lines = (tmp_path / "csv" / "odometry.csv").read_text().splitlines()
    (tmp_path / "csv" / "odometry.csv").write_text("\n".join(lines[:-1]) + "\n")
    path = tmp_path / "parquet" / "odometry.parquet"
    parquet.write_table(parquet.read_table(path)[:-1], path)

    of_others = (
        sum(log.frame(name).num_rows for name in log.topics) - log.frame("odometry").num_rows
    )
    assert lost_in_parquet(log, tmp_path / "parquet") == 1 + of_others
    assert lost_in_csv(log, tmp_path / "csv") > 1


def test_pairs_and_motions_that_are_other_ones_are_counted(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker)
    log = open_log(REFERENCE)
    pairs = log.frame(topics.STEREO).num_rows
    motions = log.frame(topics.ODOMETRY).num_rows

    assert lost_in_bag(log, tmp_path / "bag") == pairs + motions
