"""Writes the topics of a log as files of tables, CSV or Parquet: a file a topic."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from cogmap.errors import UsageError
from cogmap.recording.log import Log
from cogmap.recording.storage.reader import Progress
from cogmap.recording.table import arrow_library
from cogmap.schemas.topics import Topic

if TYPE_CHECKING:
    import pyarrow

SPAN_S = 20.0
"""A file is written in parts of so much of the log, so that a long one needs no more memory."""


class TableFormat(enum.StrEnum):
    """CSV: lists, arrays and maps are JSON in their cells. PARQUET: they are as they are."""

    CSV = "csv"
    PARQUET = "parquet"


def write_tables(
    log: Log,
    folder: Path,
    kind: TableFormat,
    topics: Iterable[Topic],
    progress: Progress | None = None,
) -> dict[str, int]:
    """Write a file for each of `topics` that has messages into the new folder `folder`. Returns the
    number of rows by topic.

    CSV has no images: such a topic is left out. Raises UsageError if the folder exists or there is
    no pyarrow, and LogError if the log is damaged.
    """
    arrow_library()
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise UsageError(f"{folder} exists already: name a new folder") from None

    chosen = [topic for topic in topics if kind is TableFormat.PARQUET or not topic.carries_images]
    rows: dict[str, int] = {}
    for number, topic in enumerate(chosen):

        def done(share: float, number: int = number) -> None:
            if progress is not None:
                progress((number + share) / len(chosen))

        path = folder / f"{topic.file_stem}.{kind.value}"
        count = _WRITERS[kind](path, _parts(log, topic, done))
        if count:
            rows[topic.name] = count
    return rows


def _parts(log: Log, topic: Topic, done: Progress) -> Iterator[pyarrow.Table]:
    """Yield the table of a topic in parts that are not empty."""
    begin_s = 0.0
    while begin_s <= log.duration_s:
        part = log.frame(topic, start_s=begin_s, end_s=begin_s + SPAN_S)
        begin_s += SPAN_S
        done(min(1.0, begin_s / (log.duration_s + SPAN_S)))
        if part.num_rows:
            yield part


def _write_parquet(path: Path, parts: Iterator[pyarrow.Table]) -> int:
    from pyarrow import parquet

    return _write(parts, lambda schema: parquet.ParquetWriter(path, schema))


def _write_csv(path: Path, parts: Iterator[pyarrow.Table]) -> int:
    from pyarrow import csv

    return _write(map(flat, parts), lambda schema: csv.CSVWriter(path, schema))


def _write(parts: Iterator[pyarrow.Table], opened: Callable[[pyarrow.Schema], Any]) -> int:
    """Write all parts by the writer that `opened` returns for their schema. Returns the rows."""
    writer = None
    rows = 0
    try:
        for part in parts:
            if writer is None:
                writer = opened(part.schema)
            writer.write_table(part)
            rows += part.num_rows
    finally:
        if writer is not None:
            writer.close()
    return rows


def flat(part: pyarrow.Table) -> pyarrow.Table:
    """Return a table whose lists, maps and structs are JSON."""
    import pyarrow

    columns = {}
    for name in part.column_names:
        column = part[name]
        if pyarrow.types.is_nested(column.type):
            texts = [msgspec.json.encode(value).decode() for value in column.to_pylist()]
            column = pyarrow.array(texts, pyarrow.string())
        columns[name] = column
    return pyarrow.table(columns)


_WRITERS: dict[TableFormat, Callable[[Path, Iterator[pyarrow.Table]], int]] = {
    TableFormat.CSV: _write_csv,
    TableFormat.PARQUET: _write_parquet,
}
