"""Saves what can be read of a log that was cut off or damaged, chunk by chunk."""

from __future__ import annotations

import struct
from pathlib import Path

import msgspec
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema
from mcap.writer import CompressionType, Writer

from cogmap.errors import LogError
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.chunks import (
    DamageError,
    Frame,
    LogFile,
    Piece,
    channels_in,
    pieces,
    schemas_in,
)
from cogmap.recording.storage.reader import Progress
from cogmap.recording.storage.resync import all_frames

_UNBOUNDED = 2**62
_INDEX = struct.Struct("<HI")
_INDEX_ENTRY_BYTES = 16


class Recovery(msgspec.Struct, kw_only=True):
    """What was saved and what was not.

    `lost_messages` are those of damaged chunks whose index tells how many they held; a chunk that
    was cut off tells nothing. `damaged` says which bytes of the old file, and why.
    """

    messages: int = 0
    chunks: int = 0
    lost_messages: int = 0
    lost_bytes: int = 0
    damaged: list[str] = []

    @property
    def whole(self) -> bool:
        """Whether nothing was wrong with the file."""
        return not self.damaged


def recover(source: Path, target: Path, progress: Progress | None = None) -> Recovery:
    """Write every message of `source` that can be read into a new log at `target`.

    Raises LogError where there is no log at `source`, or `target` exists or cannot be written.
    """
    file = LogFile(source)
    try:
        with target.open("xb") as stream:
            writer = Writer(stream, chunk_size=_UNBOUNDED, compression=CompressionType.LZ4)
            return _Rescue(file, writer).run(progress)
    except FileExistsError:
        raise LogError(f"{target} exists already: remove it, or name another") from None
    except OSError as error:
        raise LogError(f"cannot write {target}: {error.strerror}") from None


class _Rescue:
    """Copies messages from `file` to `writer`, counting what it cannot read."""

    def __init__(self, file: LogFile, writer: Writer) -> None:
        self._file, self._writer, self._recovery = file, writer, Recovery()
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._written: dict[int, int] = {}
        self._last_chunk_lost = False

    def run(self, progress: Progress | None) -> Recovery:
        self._writer.start(layout.PROFILE, layout.software())
        for frame in all_frames(self._file, self._lose):
            try:
                self._take(frame)
            except DamageError as error:
                self._lose(frame.offset, frame.end, str(error))
                self._last_chunk_lost = frame.opcode == Opcode.CHUNK
            if progress is not None:
                progress(frame.end / self._file.size)
        facts = {"from": self._file.path.name, "lost_bytes": str(self._recovery.lost_bytes)}
        self._writer.add_metadata("recovered", facts)
        self._writer.finish()  # type: ignore[no-untyped-call]
        return self._recovery

    def _take(self, frame: Frame) -> None:
        if frame.opcode == Opcode.CHUNK:
            self._take_chunk(self._file.data(frame))
            self._last_chunk_lost = False
        elif frame.opcode == Opcode.MESSAGE_INDEX and self._last_chunk_lost:
            self._count_lost(frame)
        record = self._file.parse(frame)
        if isinstance(record, Metadata):
            self._writer.add_metadata(record.name, record.metadata)

    def _take_chunk(self, data: bytes) -> None:
        found = list(pieces(data))
        self._schemas |= {schema.id: schema for schema in schemas_in(data)}
        self._channels |= {channel.id: channel for channel in channels_in(data)}
        self._check_channels(found)
        for identifier in sorted(self._channels.keys() - self._written.keys()):
            self._write_channel(self._channels[identifier])
        for piece in found:
            payload = data[piece.start : piece.end]
            self._writer.add_message(
                self._written[piece.channel],
                piece.log_time_ns,
                payload,
                piece.publish_ns,
                piece.sequence,
            )
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._recovery.messages += sum(
            self._channels[piece.channel].topic != layout.ENVELOPES for piece in found
        )
        self._recovery.chunks += 1

    def _check_channels(self, found: list[Piece]) -> None:
        """Raise DamageError where no readable part of the file declares the channel of a message."""
        if any(piece.channel not in self._channels for piece in found):
            self._read_summary()
        for piece in found:
            if piece.channel not in self._channels:
                raise DamageError(f"nothing that can be read declares its channel {piece.channel}")

    def _write_channel(self, channel: Channel) -> None:
        schema = self._schemas.get(channel.schema_id)
        schema_id = 0
        if schema is not None:
            schema_id = self._writer.register_schema(schema.name, schema.encoding, schema.data)
        self._written[channel.id] = self._writer.register_channel(
            channel.topic, channel.message_encoding, schema_id, channel.metadata
        )

    def _read_summary(self) -> None:
        """Take channels and schemas from the end of the file: the chunk that declared them is
        damaged.
        """
        for frame in all_frames(self._file, lambda *_: None):
            record = self._file.parse(frame)
            if isinstance(record, Channel):
                self._channels[record.id] = record
            elif isinstance(record, Schema):
                self._schemas[record.id] = record

    def _count_lost(self, index: Frame) -> None:
        channel, length = _INDEX.unpack_from(self._file.bytes, index.start)
        if channel not in self._channels:
            self._read_summary()
        known = self._channels.get(channel)
        if known is None or known.topic != layout.ENVELOPES:
            self._recovery.lost_messages += length // _INDEX_ENTRY_BYTES

    def _lose(self, start: int, end: int, reason: str) -> None:
        self._recovery.lost_bytes += end - start
        self._recovery.damaged.append(f"bytes {start} to {end}: {reason}")
