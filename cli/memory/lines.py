"""An export of the database: JSON lines, a head and then a record a line, oldest first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final, Literal, TypeVar

import msgspec

from cogmap.errors import StorageError
from cogmap.runtime.state.record import Record, digest_of

FORMAT: Final = "cogmap-memory"
VERSION = 1
T = TypeVar("T")


class Head(msgspec.Struct, frozen=True):
    """The first line: what follows, and how many records."""

    format: Literal["cogmap-memory"]
    version: int
    count: int


class Line(msgspec.Struct, frozen=True):
    """A record; JSON has its payload and its digest as base64.

    The digest is that of the record with the sequence number that it has after an import: 1 in the
    line after the head, and so on. So lines in another order do not fit either.
    """

    key: str
    kind: str
    payload: bytes
    digest: bytes


_heads = msgspec.json.Decoder(Head)
_lines = msgspec.json.Decoder(Line)


def written(records: Iterable[Record], count: int) -> Iterator[bytes]:
    """Yield the lines of an export of `count` records."""
    yield _encoded(Head(FORMAT, VERSION, count))
    for sequence, record in enumerate(records, start=1):
        line = Line(record.key, record.kind, record.payload, digest_of(record, sequence))
        yield _encoded(line)


def head(path: Path, line: bytes) -> Head:
    """Parse the head of the export at `path`. Raises StorageError if it is none of ours."""
    found = _decoded(_heads, line)
    if found is None:
        raise StorageError(
            f"{path}, line 1 is not the head of an export: name a file that "
            f"`cogmap memory export` wrote"
        )
    if found.version != VERSION:
        raise StorageError(
            f"{path} is an export of version {found.version}, and this program reads {VERSION}: "
            f"install the Cogmap that wrote it, or a newer one"
        )

    return found


def records(path: Path, lines: Iterable[bytes], count: int) -> Iterator[Record]:
    """Yield the records of the `lines` after the head, which are to be `count`.

    Raises StorageError at a line that is damaged, by its number in the file, and at the end if
    lines are missing or too many.
    """
    sequence = 0
    for sequence, line in enumerate(lines, start=1):
        record = _record(line, sequence)
        if record is None:
            raise StorageError(
                f"{path}, line {sequence + 1} is damaged: name another export of this memory"
            )
        yield record

    if sequence != count:
        raise StorageError(
            f"{path} has {sequence} records of {count}: name another export of this memory"
        )


def _record(line: bytes, sequence: int) -> Record | None:
    """Decode the record in a line; None if the line is damaged."""
    found = _decoded(_lines, line)
    if found is None:
        return None

    record = Record(found.key, found.kind, found.payload)
    return record if digest_of(record, sequence) == found.digest else None


def _encoded(line: Head | Line) -> bytes:
    return msgspec.json.encode(line) + b"\n"


def _decoded(decoder: msgspec.json.Decoder[T], line: bytes) -> T | None:
    """Decode what a line holds; None if it is damaged."""
    try:
        return decoder.decode(line)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None
