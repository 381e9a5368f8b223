"""An MCAP file as bytes: its records one after the other, its chunks, and the records within a
chunk.

It needs no footer, so it reads a file that is still being written or was cut off.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, McapRecord, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from cogmap.errors import LogError

HEAD = struct.Struct("<BQ")
_CHUNK_TIMES = struct.Struct("<QQ")
_MESSAGE = struct.Struct("<HIQQ")
_PARSED: dict[int, type[McapRecord]] = {
    Opcode.HEADER: Header,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.METADATA: Metadata,
}
_LAST_OPCODE = max(Opcode)


class DamageError(Exception):
    """A chunk cannot be read; where and why is for whoever catches it to say."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A record: its opcode, where it begins, and where its content lies in the file."""

    opcode: int
    offset: int
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Piece:
    """A message within a chunk: its header, and where its payload lies in the chunk's data."""

    channel: int
    sequence: int
    log_time_ns: int
    publish_ns: int
    start: int
    end: int


class LogFile:
    """A log's bytes, mapped. Raises LogError where there is no such file, or it is no log."""

    def __init__(self, path: Path) -> None:
        try:
            with path.open("rb") as file:
                self.bytes = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except FileNotFoundError:
            raise LogError(f"no log {path}: name a file that `cogmap log record` wrote") from None
        except (OSError, ValueError) as error:
            raise LogError(f"cannot read {path}: {error}") from None
        if self.bytes[: len(MCAP0_MAGIC)] != MCAP0_MAGIC:
            raise LogError(f"{path} is not an MCAP file: name one that `cogmap log record` wrote")
        self.path = path
        self.size = len(self.bytes)

    def frames(self, offset: int = len(MCAP0_MAGIC)) -> Iterator[Frame]:
        """The whole records from `offset` on, up to the footer or to where the file makes no more
        sense.
        """
        while offset + HEAD.size <= self.size:
            opcode, length = HEAD.unpack_from(self.bytes, offset)
            start = offset + HEAD.size
            if not 0 < opcode <= _LAST_OPCODE or start + length > self.size:
                return
            yield Frame(opcode, offset, start, start + length)
            if opcode == Opcode.FOOTER:
                return
            offset = start + length

    def parse(self, frame: Frame) -> McapRecord | None:
        """The record of a header, schema, channel or metadata; None for any other. Raises
        DamageError.
        """
        return _parse(frame.opcode, self.bytes[frame.start : frame.end])

    def times_ns(self, chunk: Frame) -> tuple[int, int]:
        """The log times of the first and the last message in a chunk. Raises DamageError."""
        if chunk.end - chunk.start < _CHUNK_TIMES.size:
            raise DamageError("it has no header")
        first_ns, last_ns = _CHUNK_TIMES.unpack_from(self.bytes, chunk.start)
        return first_ns, last_ns

    def data(self, chunk: Frame, check: bool = True) -> bytes:
        """The chunk's records, decompressed and, with `check`, held against their checksum. Raises
        DamageError.
        """
        try:
            record = Chunk.read(ReadDataStream(BytesIO(self.bytes[chunk.start : chunk.end])))
            stream, length = get_chunk_data_stream(record, validate_crc=check)
            return stream.read(length)
        except Exception as error:  # each decompressor has errors of its own
            raise DamageError(str(error)) from error


def channels_in(data: bytes) -> Iterator[Channel]:
    """The channels that a chunk declares. Raises DamageError."""
    for opcode, start, end in _records(data):
        if opcode == Opcode.CHANNEL and isinstance(
            channel := _parse(opcode, data[start:end]), Channel
        ):
            yield channel


def schemas_in(data: bytes) -> Iterator[Schema]:
    """The schemas that a chunk declares. Raises DamageError."""
    for opcode, start, end in _records(data):
        if opcode == Opcode.SCHEMA and isinstance(
            schema := _parse(opcode, data[start:end]), Schema
        ):
            yield schema


def pieces(data: bytes) -> Iterator[Piece]:
    """The messages in a chunk, in the order they were written. Raises DamageError."""
    for opcode, start, end in _records(data):
        if opcode == Opcode.MESSAGE:
            if end - start < _MESSAGE.size:
                raise DamageError("a message has no header")
            channel, sequence, log_time_ns, publish_ns = _MESSAGE.unpack_from(data, start)
            yield Piece(channel, sequence, log_time_ns, publish_ns, start + _MESSAGE.size, end)


def _records(data: bytes) -> Iterator[tuple[int, int, int]]:
    offset = 0
    while offset < len(data):
        if offset + HEAD.size > len(data):
            raise DamageError("a record ends early")
        opcode, length = HEAD.unpack_from(data, offset)
        start = offset + HEAD.size
        offset = start + length
        if offset > len(data):
            raise DamageError("a record ends early")
        yield opcode, start, offset


def _parse(opcode: int, content: bytes) -> McapRecord | None:
    kind = _PARSED.get(opcode)
    if kind is None:
        return None
    try:
        record: McapRecord = kind.read(ReadDataStream(BytesIO(content)))  # type: ignore[attr-defined]
    except Exception as error:  # the library raises whatever the nonsense in it leads to
        raise DamageError(f"a record of kind {opcode} cannot be read: {error}") from error
    return record
