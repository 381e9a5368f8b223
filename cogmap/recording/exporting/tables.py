"""Writes the topics of a log as files of tables, CSV or Parquet: a file a topic."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterable
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
    groups = _groups(chosen)
    for number, group in enumerate(groups):

        def done(share: float, number: int = number) -> None:
            if progress is not None:
                progress((number + share) / len(groups))

        rows |= _write_group(log, folder, kind, group, done)
    return {topic.name: rows[topic.name] for topic in chosen if rows[topic.name]}


def _groups(topics: list[Topic]) -> list[list[Topic]]:
    """Return the topics that are read at once: all small ones, and each one of images by itself,
    which would fill the memory.
    """
    images = [[topic] for topic in topics if topic.carries_images]
    small = [topic for topic in topics if not topic.carries_images]
    return [small, *images] if small else images


def _write_group(
    log: Log, folder: Path, kind: TableFormat, group: list[Topic], done: Progress
) -> dict[str, int]:
    """Write the files of some topics, in parts. Returns the number of rows by topic."""
    files = {topic: _File(folder / f"{topic.file_stem}.{kind.value}", kind) for topic in group}
    begin_s = 0.0
    try:
        while begin_s <= log.duration_s:
            for topic, part in log.frames(group, start_s=begin_s, end_s=begin_s + SPAN_S):
                files[topic].write(part)
            begin_s += SPAN_S
            done(min(1.0, begin_s / (log.duration_s + SPAN_S)))
    finally:
        for file in files.values():
            file.close()
    return {topic.name: file.rows for topic, file in files.items()}


class _File:
    """A file of a table, which is made with its first row."""

    def __init__(self, path: Path, kind: TableFormat) -> None:
        self.rows = 0
        self._path = path
        self._kind = kind
        self._writer: Any = None

    def write(self, part: pyarrow.Table) -> None:
        """Add the rows of a part."""
        if not part.num_rows:
            return

        if self._kind is TableFormat.CSV:
            part = flat(part)
        if self._writer is None:
            self._writer = _WRITERS[self._kind](self._path, part.schema)
        self._writer.write_table(part)
        self.rows += part.num_rows

    def close(self) -> None:
        """Finish the file, if there is one."""
        if self._writer is not None:
            self._writer.close()


def _parquet_writer(path: Path, schema: pyarrow.Schema) -> Any:
    from pyarrow import parquet

    return parquet.ParquetWriter(path, schema)


def _csv_writer(path: Path, schema: pyarrow.Schema) -> Any:
    from pyarrow import csv

    return csv.CSVWriter(path, schema)


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


_WRITERS: dict[TableFormat, Callable[[Path, pyarrow.Schema], Any]] = {
    TableFormat.CSV: _csv_writer,
    TableFormat.PARQUET: _parquet_writer,
}
