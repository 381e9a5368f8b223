"""The metrics of export: how fast a drive is written for other tools, and what that loses."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.benchmark import Setting, path_option
from benchmarks.dashboard.drives import Driven
from benchmarks.export import round_trips
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.recording import open_log, selection
from cogmap.recording.exporting.foxglove import write_foxglove
from cogmap.recording.exporting.rerun import library, write_rerun
from cogmap.recording.exporting.rosbag2 import write_rosbag2
from cogmap.recording.exporting.tables import TableFormat, write_tables
from cogmap.recording.log import Log
from cogmap.schemas import topics

THRESHOLDS = {"speed_min": at_least(10.0), "lost": at_most(0.0)}
OPTIONS = [
    path_option(
        "--log",
        "source",
        metavar="LOG",
        text="A drive with cameras, or its folder; without it one is driven first.",
    )
]
DRIVE_S = 90

Write = Callable[[Log, Path], object]
Lost = Callable[[Log, Path], int]


def _write_tables(kind: TableFormat, log: Log, folder: Path) -> None:
    write_tables(log, folder, kind, selection.named(log.topics))


FORMATS: dict[str, tuple[Write, Lost]] = {
    "csv": (partial(_write_tables, TableFormat.CSV), round_trips.lost_in_csv),
    "parquet": (partial(_write_tables, TableFormat.PARQUET), round_trips.lost_in_parquet),
    "foxglove": (write_foxglove, round_trips.lost_in_foxglove),
    "rerun": (write_rerun, round_trips.lost_in_rerun),
    "rosbag2": (write_rosbag2, round_trips.lost_in_bag),
}
"""What writes each format, and what counts the messages that do not come back as they were."""


def measure(setting: Setting, source: Path | None = None) -> Metrics:
    """Measure how fast a drive is exported, and how many of its messages do not come back.

    Drives a minute and a half with cameras in lockstep, and writes it in each format: a second of
    the drive a second is real time, whatever the machine took to drive it. Each is read back by the
    library of the format, a bag of ROS as a recording is. Takes five minutes.
    """
    library()  # which is not in every set-up: says so at once
    announce = setting.announce
    if source is None:
        announce(f"driving for {DRIVE_S} s in lockstep")
        duration = f"sim.duration_s={DRIVE_S}"
        driven = Driven(setting.folder / "drive", "--lockstep", "--set", duration)
        driven.end()
        source = driven.log

    speeds: Metrics = {}
    lost: Metrics = {}
    with open_log(source) as log:
        drive_s = _drive_s(log)
        for name, (write, lost_in) in FORMATS.items():
            announce(f"writing and reading {name}")
            path = setting.folder / name
            begin_s = time.perf_counter()
            write(log, path)
            speeds[f"{name}_speed"] = drive_s / (time.perf_counter() - begin_s)
            lost[f"{name}_lost"] = float(lost_in(log, path))

    return {
        "speed_min": min(speeds.values()),
        "lost": sum(lost.values()),
        "drive_s": drive_s,
        **speeds,
        **lost,
    }


def _drive_s(log: Log) -> float:
    """Return how long the drive took on its own clock."""
    stamps_ns = [entry.message.stamp_ns for entry in log.messages(topics.CLOCK)]
    return (stamps_ns[-1] - stamps_ns[0]) / 1e9
