"""The one reader of logs: messages in order of log time, from a finished file or a cut one."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from mcap.records import Message as Written

from cogmap.bus.codec import Envelope, decode
from cogmap.errors import LogError
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.format import EnvelopeRecord
from cogmap.recording.storage.index import (
    ChunkSpan,
    DamageError,
    channels_in,
    messages_in,
    read_chunk,
    read_index,
)
from cogmap.recording.storage.versions import check_readable
from cogmap.schemas.base import Message
from cogmap.schemas.topics import BY_NAME, Topic

_CACHED_CHUNKS = 12
_envelope_decoder = msgspec.msgpack.Decoder(EnvelopeRecord)
_stub_decoder = msgspec.msgpack.Decoder(Message)
Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Record:
    """A message in a log, not decoded: all that is known of it but its bytes.

    `chunk` and `position` name it within the log, by the number of its chunk in order of time and
    of itself in the chunk; `size` is its bytes.
    """

    topic_name: str
    channel: int
    sequence: int
    log_time_ns: int
    publish_ns: int
    envelope: Envelope | None
    chunk: int
    position: int
    size: int

    @property
    def topic(self) -> Topic:
        """The row of the table that it travelled on."""
        return BY_NAME[self.topic_name]


class LogReader:
    """The log at `path`. `cut_bytes` at its end belong to no whole record: it was cut off, or is
    being written.

    Raises LogError where it is missing, foreign, of a version that is not read here, or damaged;
    damage is found when the chunk concerned is read.
    """

    def __init__(self, path: Path) -> None:
        index = read_index(path)
        self.path = path
        self.size_bytes = path.stat().st_size
        self.channels = index.channels
        self.metadata = index.metadata
        self.cut_bytes = index.unreadable_bytes
        self._chunks = index.chunks
        self._cache: OrderedDict[int, list[Written]] = OrderedDict()
        check_readable(path, index.library, self.about(layout.RECORDING).get("software", ""))

    def about(self, name: str) -> dict[str, str]:
        """The last metadata record called `name`, empty where there is none."""
        for found, facts in reversed(self.metadata):
            if found == name:
                return facts
        return {}

    @property
    def span_ns(self) -> tuple[int, int]:
        """The log times of the first and the last message, (0, 0) where there is none."""
        if not self._chunks:
            return 0, 0
        first_ns = min(chunk.first_ns for chunk in self._chunks)
        last_ns = max(chunk.last_ns for chunk in self._chunks)
        return first_ns, last_ns

    @property
    def span_s(self) -> float:
        """Seconds from the first message to the last."""
        first_ns, last_ns = self.span_ns
        return (last_ns - first_ns) / 1e9

    def records(
        self,
        topics: Collection[Topic] | None = None,
        progress: Progress | None = None,
        *,
        start_ns: int = 0,
        end_ns: int = layout.MAX_TIME_NS + 1,
    ) -> Iterator[Record]:
        """Messages on `topics`, on all known ones where it is None, in order of log time.

        Those of log times from `start_ns` (inclusive) to `end_ns` (exclusive); chunks without any
        are not read. Those of one time come as they were written. `progress` is called with the
        share of chunks that have been read. Raises LogError.
        """
        waiting: list[Record] = []
        numbers = self._chunks_between(start_ns, end_ns)
        for done, number in enumerate(numbers, start=1):
            found = self._records_of(number, topics)
            waiting += [record for record in found if start_ns <= record.log_time_ns < end_ns]
            waiting.sort(key=lambda record: record.log_time_ns)

            ready = _count_before(waiting, self._start_ns(number + 1))
            yield from waiting[:ready]
            del waiting[:ready]

            if progress is not None:
                progress(done / len(numbers))
        yield from waiting

    def payload(self, record: Record) -> bytes:
        """The bytes of a message, as they travelled.

        Quick where records are asked for roughly in order: the last few chunks are kept. Raises
        LogError.
        """
        message = self._messages(record.chunk)[record.position]
        data: bytes = message.data
        return data

    def message(self, record: Record) -> Message:
        """The message, decoded. Raises LogError; MessageError where it does not fit its topic."""
        return decode(record.topic, self.payload(record))

    def stub(self, record: Record) -> Message:
        """What every message has: its stamp, number and source. Raises LogError."""
        try:
            return _stub_decoder.decode(self.payload(record))
        except msgspec.DecodeError as error:
            topic = record.topic_name
            raise LogError(f"{self.path}: a message of {topic} cannot be read: {error}") from None

    def _chunks_between(self, start_ns: int, end_ns: int) -> list[int]:
        """The numbers of the chunks that may hold messages of these log times."""
        numbers = []
        for number, chunk in enumerate(self._chunks):
            if chunk.last_ns >= start_ns and chunk.first_ns < end_ns:
                numbers.append(number)
        return numbers

    def _start_ns(self, number: int) -> int:
        """The first log time in a chunk; later than any where there is no such chunk."""
        if number < len(self._chunks):
            return self._chunks[number].first_ns
        return layout.MAX_TIME_NS + 1

    def _records_of(self, number: int, topics: Collection[Topic] | None) -> Iterator[Record]:
        """The messages of one chunk, each with the envelope that was written just before it."""
        before: Written | None = None
        for position, message in enumerate(self._messages(number)):
            name = self._topic_name(message)
            if name == layout.ENVELOPES:
                before = message
                continue

            topic = BY_NAME.get(name)
            if topic is not None and (topics is None or topic in topics):
                envelope = _matching(before, message, name)
                yield _record(message, name, envelope, (number, position))
            before = None

    def _topic_name(self, message: Written) -> str:
        """The topic of a message's channel, empty where nothing declares that channel."""
        channel = self.channels.get(message.channel_id)
        return "" if channel is None else channel.topic

    def _messages(self, number: int) -> list[Written]:
        """The messages in a chunk, envelopes among them, from the cache where they are there."""
        cached = self._cache.get(number)
        if cached is not None:
            self._cache.move_to_end(number)
            return cached

        chunk = self._chunks[number]
        try:
            contents = read_chunk(self.path, chunk)
        except DamageError as error:
            raise self._damaged(chunk, error) from None

        self.channels |= channels_in(contents)
        messages = messages_in(contents)
        self._cache[number] = messages
        if len(self._cache) > _CACHED_CHUNKS:
            self._cache.popitem(last=False)
        return messages

    def _damaged(self, chunk: ChunkSpan, error: DamageError) -> LogError:
        return LogError(
            f"{self.path}: the chunk at byte {chunk.offset} is damaged ({error}): "
            f"`cogmap log recover {self.path} OUT` saves the rest"
        )


def _count_before(records: list[Record], time_ns: int) -> int:
    """How many of the records, which are in order, were received before `time_ns`."""
    for number, record in enumerate(records):
        if record.log_time_ns >= time_ns:
            return number
    return len(records)


def _record(
    message: Written, name: str, envelope: Envelope | None, place: tuple[int, int]
) -> Record:
    chunk, position = place
    return Record(
        topic_name=name,
        channel=message.channel_id,
        sequence=message.sequence,
        log_time_ns=message.log_time,
        publish_ns=message.publish_time,
        envelope=envelope,
        chunk=chunk,
        position=position,
        size=len(message.data),
    )


def _matching(before: Written | None, message: Written, name: str) -> Envelope | None:
    """The envelope in the record `before` a message; None where that is not this message's."""
    if before is None or _key(before) != _key(message):
        return None
    try:
        record = _envelope_decoder.decode(before.data)
    except msgspec.DecodeError:
        return None
    return record.envelope() if record.topic == name else None


def _key(message: Written) -> tuple[Any, Any]:
    return message.log_time, message.sequence
