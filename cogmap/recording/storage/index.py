"""What a log contains and where: its channels, chunks and metadata, read by the MCAP library.

A log with chunks and an index of them at its end is read by that. Any other, such as one that is
being written, was cut off, or has messages outside chunks, is read from its beginning up to the
first record that is not whole.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, Footer, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC

from cogmap.errors import LogError
from cogmap.recording.storage.format import LOG_NAME

# A run of messages outside chunks is read at once: about what a chunk of ours holds.
RUN_BYTES = 1 << 20


class DamageError(Exception):
    """A part of a log cannot be read. Whoever catches it knows which, and names it."""


@dataclass(frozen=True, slots=True)
class ChunkSpan:
    """A chunk, or a run of messages outside chunks: where it begins and ends in the file, and the
    earliest and latest log time in it.
    """

    offset: int
    end: int
    first_ns: int
    last_ns: int
    is_chunk: bool = True

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
    records: list[McapRecord] = []
    try:
        with path.open("rb") as file:
            file.seek(chunk.offset)
            reader = StreamReader(file, skip_magic=True, emit_chunks=True)
            for record in reader.records:
                records += open_chunk(record) if isinstance(record, Chunk) else [record]
                if file.tell() >= chunk.end:
                    break
        return records
    except OSError as error:
        raise LogError(f"cannot read {path}: {error.strerror}") from None
    except DamageError:
        raise
    except Exception as error:  # the library raises whatever the nonsense in it leads to
        raise DamageError(str(error)) from error


def open_chunk(chunk: Chunk) -> list[McapRecord]:
    """Unpack the records of a chunk. Raises DamageError, also for a wrong checksum."""
    try:
        return breakup_chunk(chunk, validate_crc=True)
    except Exception as error:  # each decompressor has errors of its own
        raise DamageError(str(error)) from error


def channels_in(records: list[McapRecord]) -> dict[int, Channel]:
    """Return the channels among records, by their numbers."""
    return {record.id: record for record in records if isinstance(record, Channel)}


def messages_in(records: list[McapRecord]) -> list[Message]:
    """Return the messages among records, in the order in which they were written."""
    return [record for record in records if isinstance(record, Message)]


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
            metadata = [(record.name, record.metadata) for record in reader.iter_metadata()]
    except Exception:  # the library raises whatever the nonsense in it leads to
        return None

    chunks = [
        ChunkSpan(
            chunk.chunk_start_offset,
            chunk.chunk_start_offset + chunk.chunk_length,
            chunk.message_start_time,
            chunk.message_end_time,
        )
        for chunk in summary.chunk_indexes
    ]
    return LogIndex(header.library, dict(summary.channels), metadata, chunks)


def _from_scan(path: Path) -> LogIndex:
    """Index all that is whole, up to the first record that is not."""
    index = LogIndex()
    size = path.stat().st_size
    with path.open("rb") as file:
        reader = StreamReader(file, emit_chunks=True, record_size_limit=size)
        end = len(MCAP0_MAGIC)
        with suppress(Exception):  # the library raises whatever the nonsense in it leads to
            for record in reader.records:
                _enter(index, record, end, file.tell())
                end = size if isinstance(record, Footer) else file.tell()

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
        case Message():
            last = index.chunks[-1] if index.chunks else None
            if last is not None and not last.is_chunk and end - last.offset <= RUN_BYTES:
                index.chunks[-1] = last.extended(end, record.log_time)
            else:
                run = ChunkSpan(offset, end, record.log_time, record.log_time, is_chunk=False)
                index.chunks.append(run)
