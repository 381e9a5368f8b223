"""The metrics of log_api: a long log opened, and its poses as a table."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import msgpack
from mcap.reader import McapReader, make_reader

from benchmarks.benchmark import Setting, path_option
from benchmarks.drive import drive
from benchmarks.log_api.long_log import LONG_BYTES, lengthen
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.errors import CogmapError
from cogmap.recording import open_log
from cogmap.recording.storage.format import LOG_NAME
from cogmap.schemas import topics

THRESHOLDS = {"open_s": at_most(1.0), "table_speedup": at_least(5.0)}
OPTIONS = [
    path_option(
        "--log",
        "source",
        metavar="LOG",
        text="A drive with cameras, or its folder, whose messages are repeated; without it one is "
        "driven first.",
    )
]
DRIVE_S = 60.0
REPEATS = 5
POSES = topics.TRUE_POSE


def measure(setting: Setting, source: Path | None = None) -> Metrics:
    """Measure how fast a log of 1 GB is opened, and its poses are read as a table.

    The messages of a drive with cameras are repeated until they fill 1 GB. Rows of poses a second
    are held against a loop over the same file with the public mcap and msgpack libraries, in turn
    with it, both from an open log; the fastest of five counts. Takes three minutes.
    """
    announce = setting.announce
    if source is None:
        announce(f"driving for {DRIVE_S:g} s")
        drive(setting.folder, seconds=DRIVE_S)
        source = setting.folder / LOG_NAME

    announce(f"repeating its messages to {LONG_BYTES / 1e9:g} GB")
    path = setting.folder / "long.mcap"
    lengthen(source, path)

    announce("reading")
    open_s = min(_seconds(lambda: open_log(path)) for _ in range(REPEATS))
    table_s = []
    loop_s = []
    with open_log(path) as log, path.open("rb") as file:
        reader = make_reader(file)
        reader.get_summary()
        for _ in range(REPEATS):
            table_s.append(_seconds(lambda: log.frame(POSES)))
            loop_s.append(_seconds(lambda: loop_rows(reader)))

        rows = log.frame(POSES).num_rows
        if rows != len(loop_rows(reader)):
            raise CogmapError(f"the table has {rows} poses, and the loop finds another number")

    return {
        "open_s": open_s,
        "table_speedup": min(loop_s) / min(table_s),
        "rows": rows,
        "rows_per_s": rows / min(table_s),
        "loop_rows_per_s": rows / min(loop_s),
        "size_gb": path.stat().st_size / 1e9,
    }


def loop_rows(reader: McapReader) -> list[tuple[int, float, float, float]]:
    """Collect the poses as somebody does who has the public libraries alone."""
    rows = []
    for _, _, record in reader.iter_messages(topics=[POSES.name]):
        pose = msgpack.unpackb(record.data)["pose"]
        rows.append((record.log_time, pose["x_m"], pose["y_m"], pose["heading_rad"]))
    return rows


def _seconds(work: Callable[[], object]) -> float:
    begin_s = time.perf_counter()
    work()
    return time.perf_counter() - begin_s
