"""What a log contains and where: its channels, chunks and metadata, read by the MCAP library.

A finished log has an index at its end. One that is being written, or was cut off, is read from its
beginning up to the first record that is not whole.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, Footer, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC

from cogmap.errors import LogError

_RECORD_HEAD_BYTES = 9


class DamageError(Exception):
    """A part of a log cannot be read. Whoever catches it knows which, and names it."""


@dataclass(frozen=True, slots=True)
class ChunkSpan:
    """Where a chunk begins in the file, and the log times of its first and last message."""

    offset: int
    first_ns: int
    last_ns: int


@dataclass
class LogIndex:
    """The contents of a log but for its messages; chunks in order of time.

    `unreadable_bytes` at its end belong to no whole record. Channels that only a later chunk
    declares are missing where the log has no index of its own.
    """

    library: str = ""
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    chunks: list[ChunkSpan] = field(default_factory=list)
    unreadable_bytes: int = 0


def check_magic(path: Path) -> None:
    """Raise LogError where there is no file at `path`, or it is not MCAP."""
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
    """The index of the log at `path`. Raises LogError where there is no file, or it is not MCAP."""
    check_magic(path)
    index = _from_summary(path) or _from_scan(path)
    index.chunks.sort(key=lambda chunk: (chunk.first_ns, chunk.last_ns, chunk.offset))
    return index


def read_chunk(path: Path, chunk: ChunkSpan) -> list[McapRecord]:
    """The schemas, channels and messages in a chunk, as written. Raises DamageError."""
    try:
        with path.open("rb") as file:
            file.seek(chunk.offset + _RECORD_HEAD_BYTES)
            record = Chunk.read(ReadDataStream(file))
        return open_chunk(record)
    except OSError as error:
        raise LogError(f"cannot read {path}: {error.strerror}") from None
    except DamageError:
        raise
    except Exception as error:  # the library raises whatever the nonsense in it leads to
        raise DamageError(str(error)) from error


def open_chunk(chunk: Chunk) -> list[McapRecord]:
    """The schemas, channels and messages in a chunk. Raises DamageError for a wrong checksum."""
    try:
        return breakup_chunk(chunk, validate_crc=True)
    except Exception as error:  # each decompressor has errors of its own
        raise DamageError(str(error)) from error


def channels_in(records: list[McapRecord]) -> dict[int, Channel]:
    """The channels that a chunk declares, by their numbers."""
    return {record.id: record for record in records if isinstance(record, Channel)}


def messages_in(records: list[McapRecord]) -> list[Message]:
    """The messages in a chunk, in the order in which they were written."""
    return [record for record in records if isinstance(record, Message)]


def _from_summary(path: Path) -> LogIndex | None:
    """The index that a finished log has at its end; None where there is none, or it is damaged."""
    try:
        with path.open("rb") as file:
            reader = SeekingReader(file, record_size_limit=path.stat().st_size)
            summary = reader.get_summary()
            if summary is None:
                return None
            header = reader.get_header()
            metadata = [(record.name, record.metadata) for record in reader.iter_metadata()]
    except Exception:  # the library raises whatever the nonsense in it leads to
        return None

    chunks = [
        ChunkSpan(chunk.chunk_start_offset, chunk.message_start_time, chunk.message_end_time)
        for chunk in summary.chunk_indexes
    ]
    return LogIndex(header.library, dict(summary.channels), metadata, chunks)


def _from_scan(path: Path) -> LogIndex:
    """The index of all that is whole, up to the first record that is not."""
    index = LogIndex()
    size = path.stat().st_size
    with path.open("rb") as file:
        reader = StreamReader(file, emit_chunks=True, record_size_limit=size)
        end = len(MCAP0_MAGIC)
        with suppress(Exception):  # the library raises whatever the nonsense in it leads to
            for record in reader.records:
                _enter(index, record, end)
                end = size if isinstance(record, Footer) else file.tell()

    index.unreadable_bytes = max(0, size - end)
    return index


def _enter(index: LogIndex, record: McapRecord, offset: int) -> None:
    """Put a record that begins at `offset` into the index."""
    match record:
        case Header():
            index.library = record.library
        case Channel():
            index.channels[record.id] = record
        case Metadata():
            index.metadata.append((record.name, record.metadata))
        case Chunk():
            if not index.chunks:
                index.channels |= _declared(record)
            span = ChunkSpan(offset, record.message_start_time, record.message_end_time)
            index.chunks.append(span)


def _declared(chunk: Chunk) -> dict[int, Channel]:
    """The channels that a chunk declares; none where it is damaged, which its reader reports."""
    try:
        return channels_in(open_chunk(chunk))
    except DamageError:
        return {}
