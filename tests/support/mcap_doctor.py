"""What the official `mcap doctor` warns of, checked with the MCAP library alone."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from mcap.records import Channel, Chunk, Header, McapRecord, Message, Schema, Statistics
from mcap.stream_reader import StreamReader, breakup_chunk

PROFILES = {"", "ros1", "ros2"}


class Doctor:
    """Reads a file from its beginning to its end and collects what is wrong with it."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self._declared: Counter[tuple[type, int]] = Counter()
        self._messages: Counter[int] = Counter()
        self._times_ns: list[int] = []
        self._statistics: Statistics | None = None

    def examine(self, path: Path) -> list[str]:
        with path.open("rb") as file:
            reader = StreamReader(file, emit_chunks=True, validate_crcs=True)
            for record in reader.records:
                self._examine(record)
        self._compare_statistics()
        return self.warnings

    def _examine(self, record: McapRecord) -> None:
        match record:
            case Header():
                self._examine_header(record)
            case Chunk():
                self._examine_chunk(record)
            case Statistics():
                self._statistics = record

    def _examine_header(self, header: Header) -> None:
        if header.profile not in PROFILES:
            self.warnings.append(f"profile {header.profile!r} is not well known")
        if not header.library:
            self.warnings.append("no library")

    def _examine_chunk(self, chunk: Chunk) -> None:
        times_ns = []
        for record in breakup_chunk(chunk, validate_crc=True):
            match record:
                case Schema():
                    self._examine_schema(record)
                case Channel():
                    self._examine_channel(record)
                case Message():
                    self._examine_message(record)
                    times_ns.append(record.log_time)

        stated_ns = chunk.message_start_time, chunk.message_end_time
        if (min(times_ns), max(times_ns)) != stated_ns:
            self.warnings.append("a chunk's times are not those of its messages")

    def _examine_schema(self, schema: Schema) -> None:
        self._declare(Schema, schema.id)
        if not (schema.id and schema.encoding and schema.data):
            self.warnings.append(f"schema {schema.name} lacks number, encoding or data")

    def _examine_channel(self, channel: Channel) -> None:
        self._declare(Channel, channel.id)
        if (Schema, channel.schema_id) not in self._declared:
            self.warnings.append(f"the schema of {channel.topic} is declared nowhere")

    def _declare(self, kind: type, number: int) -> None:
        key = kind, number
        self._declared[key] += 1
        if self._declared[key] > 1:
            self.warnings.append(f"{key} is declared twice")

    def _examine_message(self, message: Message) -> None:
        channel = message.channel_id
        time_ns = message.log_time
        if (Channel, channel) not in self._declared:
            self.warnings.append(f"a message comes before its channel {channel}")
        if self._times_ns and time_ns < self._times_ns[-1]:
            self.warnings.append(f"log time {time_ns} is less than the one before")

        self._messages[channel] += 1
        self._times_ns.append(time_ns)

    def _compare_statistics(self) -> None:
        found = self._statistics
        if found is None:
            self.warnings.append("no statistics")
            return
        if found.channel_message_counts != dict(self._messages):
            self.warnings.append("the statistics count other messages")
        span_ns = found.message_start_time, found.message_end_time
        if self._times_ns and span_ns != (self._times_ns[0], self._times_ns[-1]):
            self.warnings.append("the statistics name other times")
