"""Finds the records of a damaged file again after a place where none begins.

The MCAP library reads record after record and stops at the first that it cannot read. A recorded
drive of 0.2 laps (42 MB, 1832 messages, 53 chunks) with one wrong byte in the chunk in its middle:
the library gives 658 messages, this module 1793, all but those of that chunk, in 0.26 s of CPU
time. So this much of MCAP's layout is read here: a record's opcode and length, and the place of a
chunk's compression. The contents of records are the library's to read.
"""

from __future__ import annotations

import mmap
import re
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, McapRecord, Message, MessageIndex, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

from cogmap.errors import LogError
from cogmap.recording.storage.chunks import DamageError
from cogmap.recording.storage.index import check_magic, log_file

_HEAD = struct.Struct("<BQ")
_COMPRESSION = re.compile(rb"\x03\x00\x00\x00lz4|\x04\x00\x00\x00zstd")
_COMPRESSION_AT = _HEAD.size + struct.calcsize("<QQQI")
_LAST_OPCODE = max(Opcode)
_KINDS: dict[int, type[McapRecord]] = {
    Opcode.HEADER: Header,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.MESSAGE: Message,
    Opcode.CHUNK: Chunk,
    Opcode.MESSAGE_INDEX: MessageIndex,
    Opcode.METADATA: Metadata,
}
Lose = Callable[[int, int, str], None]


@dataclass(frozen=True, slots=True)
class RecordSpan:
    """A record: its opcode, where it begins in the file, and where its content lies."""

    opcode: int
    offset: int
    start: int
    end: int


class LogBytes:
    """The bytes of a log, or of that in a run's folder, mapped. Raises LogError if there is no
    file, or it is not MCAP.
    """

    def __init__(self, path: Path) -> None:
        path = log_file(path)
        check_magic(path)
        try:
            with path.open("rb") as file:
                self._bytes = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except OSError as error:
            raise LogError(f"cannot read {path}: {error.strerror}") from None
        self.size = len(self._bytes)

    def records_from(self, offset: int) -> Iterator[RecordSpan]:
        """Yield the whole records from `offset` on, up to the footer or to bytes that are no
        record.
        """
        while offset + _HEAD.size <= self.size:
            opcode, length = _HEAD.unpack_from(self._bytes, offset)
            start = offset + _HEAD.size
            end = start + length
            if not 0 < opcode <= _LAST_OPCODE or end > self.size:
                return

            yield RecordSpan(opcode, offset, start, end)
            if opcode == Opcode.FOOTER:
                return
            offset = end

    def parse(self, span: RecordSpan) -> McapRecord | None:
        """Return a record's content; None for a kind that recovery does not need. Raises
        DamageError.
        """
        kind = _KINDS.get(span.opcode)
        if kind is None:
            return None
        content = ReadDataStream(BytesIO(self._bytes[span.start : span.end]))
        # Of a message, the length determines where its content ends.
        length = [span.end - span.start] if kind is Message else []
        try:
            record: McapRecord = kind.read(content, *length)  # type: ignore[attr-defined]
        except Exception as error:  # the library raises whatever the nonsense in it leads to
            raise DamageError(f"a record of kind {span.opcode} cannot be read: {error}") from error
        return record

    def all_records(self, lose: Lose) -> Iterator[RecordSpan]:
        """Yield every record that can be found; calls `lose` (from byte, to byte, why) for the
        rest.
        """
        offset = len(MCAP0_MAGIC)
        while offset < self.size:
            reached = offset
            for span in self._records_up_to_damage(offset):
                yield span
                reached = span.end
                if span.opcode == Opcode.FOOTER:
                    return

            found = self._next_chunk(reached + 1)
            if found is None:
                lose(reached, self.size, "the file is cut off here")
                return
            lose(reached, found, "no record begins here")
            offset = found
        lose(self.size, self.size, "the file is cut off here")

    def _records_up_to_damage(self, offset: int) -> Iterator[RecordSpan]:
        """Yield the records from `offset` on, up to one whose length reaches over the next
        chunk.
        """
        for span in self.records_from(offset):
            # If neither a record nor the end of the file follows, the length may be wrong.
            is_last = span.opcode == Opcode.FOOTER or span.end == self.size
            if not is_last and not self._begins_record(span.end):
                inside = self._next_chunk(span.offset + 1)
                if inside is not None and inside < span.end:
                    return
            yield span

    def _begins_record(self, offset: int) -> bool:
        return next(self.records_from(offset), None) is not None

    def _next_chunk(self, offset: int) -> int | None:
        """Return where the first chunk at or after `offset` begins that could be whole."""
        for found in _COMPRESSION.finditer(self._bytes, offset):
            start = found.start() - _COMPRESSION_AT
            is_chunk = start >= offset and self._bytes[start] == Opcode.CHUNK
            if is_chunk and self._begins_record(start):
                return start
        return None
