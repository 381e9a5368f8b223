"""Saves what can be read of a log that was cut off or damaged, chunk by chunk."""

from __future__ import annotations

from pathlib import Path

import msgspec
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    Header,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    Schema,
)
from mcap.writer import CompressionType, Writer

from cogmap.recording.storage import format as layout
from cogmap.recording.storage.chunks import DamageError, open_chunk
from cogmap.recording.storage.index import RUN_BYTES, channels_in, messages_in
from cogmap.recording.storage.reader import Progress
from cogmap.recording.storage.resync import LogBytes, RecordSpan
from cogmap.recording.storage.writer import UNBOUNDED, cannot_write, open_new


class Recovery(msgspec.Struct, kw_only=True):
    """What was saved and what was not.

    `lost_messages` are those of damaged chunks whose index names them; of a chunk that was cut off
    nothing is known. `damaged` names bytes of the old file, and why they cannot be read.
    """

    messages: int = 0
    chunks: int = 0
    lost_messages: int = 0
    lost_bytes: int = 0
    damaged: list[str] = []

    @property
    def whole(self) -> bool:
        """Return whether nothing was wrong with the file."""
        return not self.damaged


def recover(source: Path, target: Path, progress: Progress | None = None) -> Recovery:
    """Write every message of `source` that can be read into a new log at `target`.

    Raises LogError if there is no log at `source`, or `target` exists or cannot be written.
    """
    found = LogBytes(source)
    stream = open_new(target)
    try:
        with stream:
            writer = Writer(stream, chunk_size=UNBOUNDED, compression=CompressionType.LZ4)
            return _Rescue(found, writer, source.name).run(progress)
    except OSError as error:
        raise cannot_write(target, error) from None


class _Rescue:
    """Copies messages from `source` to `writer`, counting what it cannot read."""

    def __init__(self, source: LogBytes, writer: Writer, name: str) -> None:
        self._source = source
        self._writer = writer
        self._name = name
        self._recovery = Recovery()
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._written: dict[int, int] = {}
        self._last_chunk_lost = False
        self._run: list[McapRecord] = []
        self._run_bytes = 0
        self._has_read_summary = False

    def run(self, progress: Progress | None) -> Recovery:
        """Copy all that can be read. The new log names the program that wrote the old one, which
        determines its messages.
        """
        first = next(self._source.all_records(_ignore), None)
        header = None if first is None else self._parsed(first)
        library = header.library if isinstance(header, Header) else layout.SOFTWARE
        self._writer.start(layout.PROFILE, library)

        for span in self._source.all_records(self._lose):
            try:
                self._copy(self._source.parse(span))
            except DamageError as error:
                self._lose(span.offset, span.end, str(error))
                self._last_chunk_lost = span.opcode == Opcode.CHUNK
            if progress is not None:
                progress(span.end / self._source.size)
        self._copy_run()

        facts = {"from": self._name, "lost_bytes": str(self._recovery.lost_bytes)}
        self._writer.add_metadata("recovered", facts)
        self._writer.finish()  # type: ignore[no-untyped-call]
        return self._recovery

    def _copy(self, record: McapRecord | None) -> None:
        """Copy what a record holds. Raises DamageError."""
        match record:
            case Chunk():
                self._copy_run()
                self._copy_records(open_chunk(record))
                self._last_chunk_lost = False
            case Schema() | Channel() | Message():
                self._run.append(record)
                if isinstance(record, Message):
                    self._run_bytes += len(record.data)
                if self._run_bytes >= RUN_BYTES:
                    self._copy_run()
            case MessageIndex() if self._last_chunk_lost:
                if record.channel_id not in self._channels:
                    self._read_summary()
                lost = self._channels.get(record.channel_id)
                if lost is None or lost.topic != layout.ENVELOPES:
                    self._recovery.lost_messages += len(record.records)
            case Metadata():
                self._writer.add_metadata(record.name, record.metadata)

    def _copy_run(self) -> None:
        """Copy the messages outside chunks that were read since the last time."""
        run = self._run
        self._run = []
        self._run_bytes = 0
        self._copy_records(run)

    def _copy_records(self, contents: list[McapRecord]) -> None:
        """Copy messages as a chunk. Raises DamageError if nothing that can be read declares a
        channel of theirs.
        """
        messages = messages_in(contents)
        self._schemas |= {record.id: record for record in contents if isinstance(record, Schema)}
        self._channels |= channels_in(contents)
        used = {message.channel_id for message in messages}
        if not used <= self._channels.keys():
            self._read_summary()
        for missing in sorted(used - self._channels.keys()):
            raise DamageError(f"nothing that can be read declares its channel {missing}")
        if not messages:
            return

        for identifier in sorted(self._channels.keys() - self._written.keys()):
            channel = self._channels[identifier]
            schema = self._schemas.get(channel.schema_id)
            schema_id = 0
            if schema is not None:
                schema_id = self._writer.register_schema(schema.name, schema.encoding, schema.data)
            self._written[identifier] = self._writer.register_channel(
                channel.topic, channel.message_encoding, schema_id, channel.metadata
            )

        for message in messages:
            self._writer.add_message(
                self._written[message.channel_id],
                message.log_time,
                message.data,
                message.publish_time,
                message.sequence,
            )
            is_envelope = self._channels[message.channel_id].topic == layout.ENVELOPES
            self._recovery.messages += not is_envelope

        self._writer.flush()  # type: ignore[no-untyped-call]
        self._recovery.chunks += 1

    def _read_summary(self) -> None:
        """Take channels and schemas from the file's end, once: what declared them is damaged."""
        if self._has_read_summary:
            return
        self._has_read_summary = True
        for span in self._source.all_records(_ignore):
            record = self._parsed(span)
            if isinstance(record, Channel):
                self._channels[record.id] = record
            elif isinstance(record, Schema):
                self._schemas[record.id] = record

    def _parsed(self, span: RecordSpan) -> McapRecord | None:
        """Return a record's content, None if it is damaged."""
        try:
            return self._source.parse(span)
        except DamageError:
            return None

    def _lose(self, start: int, end: int, reason: str) -> None:
        recovery = self._recovery
        recovery.lost_bytes += end - start
        recovery.damaged.append(f"bytes {start} to {end}: {reason}")


def _ignore(_start: int, _end: int, _reason: str) -> None:
    """Ignore what is lost: it was counted already."""
