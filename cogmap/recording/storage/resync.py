"""Finds the records of a damaged file again after a place where none begins."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from cogmap.recording.storage.chunks import HEAD, Frame, LogFile

_COMPRESSION = b"\x03\x00\x00\x00lz4"
_COMPRESSION_AT = HEAD.size + struct.calcsize("<QQQI")
Lose = Callable[[int, int, str], None]


def all_frames(file: LogFile, lose: Lose) -> Iterator[Frame]:
    """Every record that can be found; `lose` is told (from byte, to byte, why) of what is passed
    over.
    """
    offset = len(MCAP0_MAGIC)
    while offset < file.size:
        reached = offset
        for frame in file.frames(offset):
            inside = None if _goes_on(file, frame) else _next_chunk(file, frame.offset + 1)
            if inside is not None and inside < frame.end:
                break
            yield frame
            reached = frame.end
            if frame.opcode == Opcode.FOOTER:
                return
        found = _next_chunk(file, reached + 1)
        if found is None:
            lose(reached, file.size, "the file is cut off here")
            return
        lose(reached, found, "no record begins here")
        offset = found
    lose(file.size, file.size, "the file is cut off here")


def _goes_on(file: LogFile, frame: Frame) -> bool:
    """Whether a record, or the end of the file, follows `frame`: otherwise its length may be wrong."""
    return (
        frame.opcode == Opcode.FOOTER
        or frame.end == file.size
        or any(True for _ in file.frames(frame.end))
    )


def _next_chunk(file: LogFile, offset: int) -> int | None:
    """Where the first chunk at or after `offset` begins that could be whole."""
    position = file.bytes.find(_COMPRESSION, offset)
    while position >= 0:
        start = position - _COMPRESSION_AT
        if (
            start >= offset
            and file.bytes[start] == Opcode.CHUNK
            and any(True for _ in file.frames(start))
        ):
            return start
        position = file.bytes.find(_COMPRESSION, position + 1)
    return None
