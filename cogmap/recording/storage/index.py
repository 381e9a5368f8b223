"""What a log contains and where: its channels, chunks and metadata, read by the MCAP library.

A log with chunks and an index of them at its end is read by that. Any other, such as one that is
being written, was cut off, or has messages outside chunks, is read from its beginning up to the
first record that is not whole.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import (
    Channel,
    Chunk,
    Footer,
    Header,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
)
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

from cogmap.errors import BoundError, LogError
from cogmap.files.bounds import MIB, Budget, most_unpacked
from cogmap.recording.storage.chunks import (
    RECORD_HEADER,
    DamageError,
    messages_at,
    open_chunk,
    unpacked,
)
from cogmap.recording.storage.format import LOG_NAME

# Of an index of messages its channel, and the bytes of its entries: the time of a message, and
# where it is in its chunk.
INDEX_HEADER = struct.Struct("<BQHI")
INDEX_ENTRY = struct.Struct("<QQ")
# A run of messages outside chunks is read at once: about what a chunk of ours holds.
RUN_BYTES = 1 << 20
METADATA_BYTES = 64 * MIB


@dataclass(frozen=True, slots=True)
class ChunkSpan:
    """A chunk, or a run of messages outside chunks: where it begins and ends in the file, and the
    earliest and latest log time in it.

    `indexes` are where the file has the index of its messages on a channel, by the channel's
    number, for each channel that it has messages on; None where the file does not say.
    """

    offset: int
    end: int
    first_ns: int
    last_ns: int
    is_chunk: bool = True
    indexes: dict[int, int] | None = None

    def has_any(self, channels: frozenset[int]) -> bool:
        """Return whether messages on one of these channels may be in it."""
        return self.indexes is None or not channels.isdisjoint(self.indexes)

    def extended(self, end: int, time_ns: int) -> ChunkSpan:
        """Return the run with one more message, which ends at `end`."""
        first_ns = min(self.first_ns, time_ns)
        last_ns = max(self.last_ns, time_ns)
        return replace(self, end=end, first_ns=first_ns, last_ns=last_ns)


@dataclass
class LogIndex:
    """The contents of a log but for its messages; chunks in order of time.

    `unreadable_bytes` at its end belong to no whole record. Channels that only a later chunk
    declares are missing if the log has no index of its own.
    """

    library: str = ""
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    chunks: list[ChunkSpan] = field(default_factory=list)
    unreadable_bytes: int = 0


def log_file(path: Path) -> Path:
    """Return the log at `path`, or the one in the run's folder at `path`."""
    return path / LOG_NAME if path.is_dir() else path


def check_magic(path: Path) -> None:
    """Raise LogError if there is no file at `path`, or it is not MCAP."""
    try:
        with path.open("rb") as file:
            magic = file.read(len(MCAP0_MAGIC))
    except FileNotFoundError:
        raise LogError(f"no log {path}: name a file that `cogmap log record` wrote") from None
    except OSError as error:
        raise LogError(f"cannot read {path}: {error.strerror}") from None
    if magic != MCAP0_MAGIC:
        raise LogError(f"{path} is not an MCAP file: name one that `cogmap log record` wrote")


def read_index(path: Path) -> LogIndex:
    """Read the index of the log at `path`. Raises LogError if there is none, or it is not MCAP."""
    check_magic(path)
    index = _from_summary(path) or _from_scan(path)
    index.chunks.sort(key=lambda chunk: (chunk.first_ns, chunk.last_ns, chunk.offset))
    return index


def read_chunk(path: Path, chunk: ChunkSpan) -> list[McapRecord]:
    """Read the schemas, channels and messages in a chunk, as written. Raises DamageError."""
    try:
        with path.open("rb") as file:
            file.seek(chunk.offset)
            content = BytesIO(file.read(chunk.end - chunk.offset))

        records: list[McapRecord] = []
        reader = StreamReader(content, skip_magic=True, emit_chunks=True)
        for record in reader.records:
            records += open_chunk(record) if isinstance(record, Chunk) else [record]
            if content.tell() >= chunk.end - chunk.offset:
                break
        return records
    except OSError as error:
        raise LogError(f"cannot read {path}: {error.strerror}") from None
    except DamageError:
        raise
    except Exception as error:  # the library raises whatever the nonsense in it leads to
        raise DamageError(str(error) or type(error).__name__) from error


def read_messages(file: BinaryIO, chunk: ChunkSpan, channels: Collection[int]) -> list[Message]:
    """Read the messages of a chunk on some channels, by the chunk's indexes of them: a fraction of
    what all its records cost. Raises DamageError, also for a wrong checksum.
    """
    assert chunk.indexes is not None
    indexed = [channel for channel in sorted(channels) if channel in chunk.indexes]
    if not indexed:
        return []

    try:
        file.seek(chunk.offset + RECORD_HEADER.size)
        record = Chunk.read(ReadDataStream(BytesIO(file.read(chunk.end - file.tell()))))
        contents = unpacked(record)
        found: list[Message] = []
        for channel in indexed:
            found += messages_at(contents, _offsets(file, chunk.indexes[channel]), channel)
        return found
    except OSError as error:
        raise LogError(f"cannot read {file.name}: {error.strerror}") from None
    except DamageError:
        raise
    except Exception as error:  # the library raises whatever the nonsense in it leads to
        raise DamageError(str(error) or type(error).__name__) from error


def channels_in(records: list[McapRecord]) -> dict[int, Channel]:
    """Return the channels among records, by their numbers."""
    return {record.id: record for record in records if isinstance(record, Channel)}


def messages_in(records: list[McapRecord]) -> list[Message]:
    """Return the messages among records, in the order in which they were written."""
    return [record for record in records if isinstance(record, Message)]


# What follows reads by `struct` what the library would take a dozen reads a message for, which is
# most of what a table costs.
def _offsets(file: BinaryIO, where: int) -> list[int]:
    """Read the index of messages in a chunk that begins at `where`: where each is in the chunk."""
    file.seek(where)
    header = file.read(INDEX_HEADER.size)
    opcode, _, _, size = INDEX_HEADER.unpack(header)
    if opcode != Opcode.MESSAGE_INDEX:
        raise DamageError(f"no index of its messages is at byte {where} of the log")

    return sorted(offset for _, offset in INDEX_ENTRY.iter_unpack(file.read(size)))


def _from_summary(path: Path) -> LogIndex | None:
    """Read the index of chunks at the end of a log; None if there is none, or it is damaged."""
    try:
        with path.open("rb") as file:
            reader = SeekingReader(file, record_size_limit=path.stat().st_size)
            summary = reader.get_summary()
            facts = summary.statistics if summary else None
            if summary is None or facts is None or not facts.chunk_count:
                return None
            if facts.chunk_count != len(summary.chunk_indexes):
                return None
            if facts.metadata_count != len(summary.metadata_indexes):
                return None
            header = reader.get_header()
            metadata = _bounded_metadata(path, reader)
    except BoundError:
        raise
    except Exception:  # the library raises whatever the nonsense in it leads to
        return None

    chunks = [
        ChunkSpan(
            chunk.chunk_start_offset,
            chunk.chunk_start_offset + chunk.chunk_length,
            chunk.message_start_time,
            chunk.message_end_time,
            indexes=chunk.message_index_offsets or None,
        )
        for chunk in summary.chunk_indexes
    ]
    if not _are_apart(chunks, path.stat().st_size):
        return None
    return LogIndex(header.library, dict(summary.channels), metadata, chunks)


def _bounded_metadata(path: Path, reader: SeekingReader) -> list[tuple[str, dict[str, str]]]:
    """Read the metadata of a log, of which many indexes may name one record. Raises BoundError."""
    budget = Budget(path, "has metadata of", most_unpacked(path.stat().st_size, METADATA_BYTES))
    metadata = []
    for record in reader.iter_metadata():
        facts = record.metadata
        budget.take(len(record.name) + sum(map(len, facts)) + sum(map(len, facts.values())))
        metadata.append((record.name, facts))
    return metadata


def _are_apart(chunks: Sequence[ChunkSpan], size: int) -> bool:
    """Decide whether chunks lie one after the other in a file of that size."""
    reached = len(MCAP0_MAGIC)
    for chunk in sorted(chunks, key=lambda chunk: chunk.offset):
        if not reached <= chunk.offset < chunk.end:
            return False
        reached = chunk.end
    return reached <= size


def _from_scan(path: Path) -> LogIndex:
    """Index all that is whole, up to the first record that is not."""
    index = LogIndex()
    size = path.stat().st_size
    is_finished = False
    with path.open("rb") as file:
        reader = StreamReader(file, emit_chunks=True, record_size_limit=size)
        end = len(MCAP0_MAGIC)
        with suppress(Exception):  # the library raises whatever the nonsense in it leads to
            for record in reader.records:
                _enter(index, record, end, file.tell())
                is_finished = isinstance(record, Footer)
                end = size if is_finished else file.tell()

    if index.chunks and not is_finished:
        # Of the last chunk some indexes may have been cut off.
        index.chunks[-1] = replace(index.chunks[-1], indexes=None)
    index.unreadable_bytes = max(0, size - end)
    return index


def _enter(index: LogIndex, record: McapRecord, offset: int, end: int) -> None:
    """Put a record that lies from `offset` to `end` into the index."""
    match record:
        case Header():
            index.library = record.library
        case Channel():
            index.channels[record.id] = record
        case Metadata():
            index.metadata.append((record.name, record.metadata))
        case Chunk():
            if not index.chunks:
                # A chunk that is damaged declares none: its reader reports it.
                with suppress(DamageError):
                    index.channels |= channels_in(open_chunk(record))
            span = ChunkSpan(offset, end, record.message_start_time, record.message_end_time)
            index.chunks.append(span)
        case MessageIndex() if index.chunks:
            chunk = index.chunks[-1]
            indexes = {} if chunk.indexes is None else chunk.indexes
            indexes[record.channel_id] = offset
            if chunk.indexes is None:
                index.chunks[-1] = replace(chunk, indexes=indexes)
        case Message():
            last = index.chunks[-1] if index.chunks else None
            if last is not None and not last.is_chunk and end - last.offset <= RUN_BYTES:
                index.chunks[-1] = last.extended(end, record.log_time)
            else:
                run = ChunkSpan(offset, end, record.log_time, record.log_time, is_chunk=False)
                index.chunks.append(run)
