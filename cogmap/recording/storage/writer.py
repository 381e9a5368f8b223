"""Writes a log: MCAP in chunks that are flushed often, so that a kill loses only the last ones."""

from __future__ import annotations

import enum
import errno
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.writer import CompressionType, Writer

from cogmap.bus.codec import Envelope, encode
from cogmap.errors import LogError
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.format import EnvelopeRecord
from cogmap.schemas.topics import MIB, Topic

# What may be lost if the process is killed: messages of so long, or so many bytes.
FLUSH_S = 0.25
CHUNK_BYTES = 4 * 2**20
# Of MCAP's own chunks, so that `flush` alone ends one.
UNBOUNDED = 2**62
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class Content(enum.Enum):
    """What the messages of a chunk are: who reads poses need not unpack images, nor deltas."""

    SMALL = enum.auto()
    LARGE = enum.auto()
    IMAGES = enum.auto()

    @classmethod
    def of(cls, topic: Topic) -> Content:
        """Return what the messages of `topic` are."""
        if topic.carries_images:
            return cls.IMAGES
        return cls.LARGE if topic.max_bytes > MIB else cls.SMALL


class _Waiting(NamedTuple):
    """A record of a message, as the library takes it, that is to go into a chunk."""

    channel: int
    log_time_ns: int
    data: bytes
    sent_ns: int
    sequence: int


class LogWriter:
    """A log being written at `path`, with a channel for each of `topics` in that order.

    `about` goes into the file as the facts of the recording. A call of `flush`, which `write` makes
    by itself after CHUNK_BYTES, ends a chunk of each Content. Every method raises LogError if the
    disk refuses; the log holds what was flushed before, and the writer is of no more use.
    """

    def __init__(
        self,
        path: Path,
        topics: Iterable[Topic],
        about: Mapping[str, str],
        compression: CompressionType = CompressionType.LZ4,
    ) -> None:
        self.path = path
        self._file = open_new(path)
        self._last_log_ns = -1
        self._unflushed_bytes = 0
        self._waiting: dict[Content, list[_Waiting]] = {content: [] for content in Content}
        self._writer = Writer(self._file, chunk_size=UNBOUNDED, compression=compression)
        with self._on_disk():
            self._writer.start(layout.PROFILE, layout.SOFTWARE)
        self.note(layout.RECORDING, {"software": layout.SOFTWARE, **about})

        self._envelopes = self._channel(layout.ENVELOPES, layout.envelope_schema(), {})
        self._channels: dict[Topic, int] = {}
        for topic in topics:
            facts = {"delivery": topic.delivery.name, "about": topic.scope.name}
            self._channels[topic] = self._channel(topic.name, layout.schema_of(topic), facts)

    @property
    def size_bytes(self) -> int:
        """Return how much of it is in the file."""
        return self._file.tell()

    def write(
        self, topic: Topic, payload: bytes | memoryview, envelope: Envelope | None, received_ns: int
    ) -> None:
        """Add the message that travelled as `payload` on `topic`.

        Its log time is `received_ns`, or just after the message before if the clock was set back.
        """
        log_time_ns = layout.time_field(max(self._last_log_ns + 1, received_ns))
        self._last_log_ns = log_time_ns
        sent_ns = log_time_ns
        sequence = 0

        waiting = self._waiting[Content.of(topic)]
        if envelope is not None:
            sent_ns = layout.time_field(envelope.sent_ns)
            sequence = layout.sequence_field(envelope.seq)
            record = encode(EnvelopeRecord.of(topic, envelope))
            waiting.append(_Waiting(self._envelopes, log_time_ns, record, sent_ns, sequence))

        channel = self._channels[topic]
        waiting.append(_Waiting(channel, log_time_ns, bytes(payload), sent_ns, sequence))
        self._unflushed_bytes += len(payload)
        if self._unflushed_bytes >= CHUNK_BYTES:
            self.flush()

    def note(self, name: str, facts: Mapping[str, str]) -> None:
        """Add a metadata record; it is in the file at once."""
        with self._on_disk():
            self._writer.add_metadata(name, dict(facts))
            self._file.flush()

    def flush(self) -> None:
        """Finish the chunks: what was written so far survives this process."""
        with self._on_disk():
            for waiting in self._waiting.values():
                for record in waiting:
                    self._writer.add_message(*record)
                waiting.clear()
                self._writer.flush()  # type: ignore[no-untyped-call]
        self._unflushed_bytes = 0

    def close(self) -> None:
        """Finish the file, with an index at its end."""
        self.flush()
        with self._on_disk():
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()

    @contextmanager
    def _on_disk(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            with suppress(OSError):
                self._file.close()
            raise cannot_write(self.path, error) from None

    def _channel(self, topic: str, schema: tuple[str, bytes], facts: dict[str, str]) -> int:
        name, text = schema
        identifier = self._writer.register_schema(name, layout.SCHEMA_ENCODING, text)
        return self._writer.register_channel(topic, layout.MESSAGE_ENCODING, identifier, facts)


class FlushTimer:
    """When to flush next: FLUSH_S after the last time."""

    def __init__(self) -> None:
        self._next_s = time.monotonic() + FLUSH_S

    def due_in_s(self) -> float:
        """Return the seconds until it is time to flush, 0 if it is."""
        return max(0.0, self._next_s - time.monotonic())

    def reset(self) -> None:
        """Count from now on."""
        self._next_s = time.monotonic() + FLUSH_S


def open_new(path: Path) -> BinaryIO:
    """Return a new file to write to, in a folder made if there is none. Raises LogError."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(path, error) from None

    try:
        return path.open("xb")
    except FileExistsError:
        raise _exists(path) from None
    except OSError as error:
        raise cannot_write(path, error) from None


def check_new(path: Path) -> None:
    """Raise LogError if there is a file that one which is written later would replace."""
    if path.exists():
        raise _exists(path)


def _exists(path: Path) -> LogError:
    return LogError(f"{path} exists already: remove it, or name another file")


def cannot_write(path: Path, error: OSError) -> LogError:
    """Return the error for a file that the disk did not take, with what to do about it."""
    if error.errno in _FULL:
        remedy = "free some space, or write to another disk"
    else:
        remedy = "name a file in a folder that can be written to"
    return LogError(f"cannot write {path} ({error.strerror}): {remedy}")
