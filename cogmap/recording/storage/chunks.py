"""The records in a chunk, unpacked through a bound: a chunk of 65 KB may hold gigabytes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from io import BytesIO

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema

from cogmap.files.bounds import MIB, Budget, most_unpacked

# Of any record: its opcode and its length. Of a message also its channel, its sequence, and when it
# was received and sent.
RECORD_HEADER = struct.Struct("<BQ")
MESSAGE_HEADER = struct.Struct("<BQHIQQ")
CHUNK_BYTES = 128 * MIB
"""Every chunk may unpack to this, twice our largest message, and its records may take as much."""

RECORD_BYTES = 1200
"""What a record of a chunk counts for, besides its content: three times its memory, as reading it
takes time, too.
"""


class DamageError(Exception):
    """A part of a log cannot be read. Whoever catches it knows which, and names it."""


def open_chunk(chunk: Chunk) -> list[McapRecord]:
    """Unpack the schemas, channels and messages of a chunk. Raises DamageError, also for a wrong
    checksum, and for more than a chunk of its size may hold.
    """
    try:
        contents = unpacked(chunk)
        return _records(contents, Budget("it", "holds records of", _most(chunk)))
    except DamageError:
        raise
    except Exception as error:  # each decompressor has errors of its own
        raise DamageError(str(error) or type(error).__name__) from error


def unpacked(chunk: Chunk) -> bytes:
    """Return the content of a chunk. Raises DamageError, and BoundError."""
    most = _most(chunk)
    Budget("it", "unpacks to", most).take(chunk.uncompressed_size)
    contents = _decompressed(chunk, most)
    Budget("it", "unpacks to", most).take(len(contents))
    if chunk.uncompressed_crc not in (0, zlib.crc32(contents)):
        raise DamageError("its checksum is wrong")
    return contents


def messages_at(contents: bytes, offsets: Sequence[int], channel: int) -> list[Message]:
    """Read the messages of a channel at these offsets in a chunk, which rise. Raises DamageError if
    another record is there, or the middle of one.
    """
    found = []
    end = 0
    for offset in offsets:
        if offset < end:
            raise DamageError(f"its index leads into the middle of a record at {offset}")
        opcode, length, its_channel, sequence, log_time_ns, sent_ns = MESSAGE_HEADER.unpack_from(
            contents, offset
        )
        if opcode != Opcode.MESSAGE or its_channel != channel:
            raise DamageError(f"its index leads to another record at {offset}")

        end = offset + RECORD_HEADER.size + length
        data = contents[offset + MESSAGE_HEADER.size : end]
        found.append(Message(channel, log_time_ns, data, sent_ns, sequence))
    return found


def _most(chunk: Chunk) -> int:
    return most_unpacked(len(chunk.data), CHUNK_BYTES)


def _decompressed(chunk: Chunk, most: int) -> bytes:
    """Decompress the content of a chunk, at most one byte more than `most`."""
    if not chunk.compression:
        return bytes(chunk.data)

    if chunk.compression == "zstd":
        frame = zstandard.get_frame_parameters(chunk.data)
        if frame.content_size != zstandard.CONTENTSIZE_UNKNOWN:
            Budget("it", "unpacks to", most).take(frame.content_size)
        Budget("it", "unpacks within", most).take(frame.window_size)
        opener = zstandard.ZstdDecompressor()
        return opener.decompress(chunk.data, max_output_size=chunk.uncompressed_size)

    if chunk.compression == "lz4":
        frames = lz4.frame.LZ4FrameDecompressor()
        contents: bytes = frames.decompress(chunk.data, max_length=most + 1)
        if not frames.eof and len(contents) <= most:
            raise DamageError("what is in it was cut off")
        return contents

    raise DamageError(f"it is compressed by {chunk.compression[:40]!r}, not by lz4 or zstd")


def _records(contents: bytes, budget: Budget) -> list[McapRecord]:
    found: list[McapRecord] = []
    for opcode, place, end in _spans(contents, budget):
        start = place + RECORD_HEADER.size
        if opcode == Opcode.MESSAGE:
            _, _, channel, sequence, log_time_ns, sent_ns = MESSAGE_HEADER.unpack_from(
                contents, place
            )
            data = contents[place + MESSAGE_HEADER.size : end]
            found.append(Message(channel, log_time_ns, data, sent_ns, sequence))
        elif opcode in (Opcode.CHANNEL, Opcode.SCHEMA):
            kind = Channel if opcode == Opcode.CHANNEL else Schema
            found.append(kind.read(ReadDataStream(BytesIO(contents[start:end]))))
    return found


def _spans(contents: bytes, budget: Budget) -> list[tuple[int, int, int]]:
    """Return the opcode of each record, where it begins and ends. Raises BoundError before any of
    them is read.
    """
    spans = []
    place = 0
    while place < len(contents):
        opcode, length = RECORD_HEADER.unpack_from(contents, place)
        end = place + RECORD_HEADER.size + length
        if end > len(contents):
            raise DamageError(f"the record at {place} in it was cut off")

        budget.take(RECORD_BYTES + length)
        spans.append((opcode, place, end))
        place = end
    return spans
