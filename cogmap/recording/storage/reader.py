"""The one reader of logs: messages in order of log time, from a finished file or a cut one."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import OrderedDict, defaultdict
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import BinaryIO, NamedTuple

import msgspec
from mcap.records import Message as Written

from cogmap.bus.codec import Envelope, decode
from cogmap.errors import LogError
from cogmap.files.bounds import MIB, Budget, most_unpacked
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.chunks import DamageError
from cogmap.recording.storage.format import EnvelopeRecord
from cogmap.recording.storage.index import (
    ChunkSpan,
    channels_in,
    log_file,
    messages_in,
    read_chunk,
    read_index,
    read_messages,
)
from cogmap.recording.storage.versions import check_readable
from cogmap.schemas.base import Message
from cogmap.schemas.topics import BY_NAME, Topic

# Since records are asked for roughly in order.
_CACHED_BYTES = 64 * MIB
# What is read of a small log to be put in order, or into a table, may take so much.
_HELD_BYTES = 256 * MIB
# A message takes so much, besides its content.
_MESSAGE_BYTES = 400
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
        """Return the row of the table that it travelled on."""
        return BY_NAME[self.topic_name]


class _Located(NamedTuple):
    """A record of a message, or of an envelope, with its place in the log.

    `order` is its log time and then its place in the file.
    """

    order: tuple[int, int, int]
    chunk: int
    position: int
    message: Written


_ORDER = attrgetter("order")


class EnvelopeSearch:
    """Where the envelopes of the messages in `chunks` may be, on the channels `envelopes`.

    We write an envelope into the chunk of its message. Other programs may have put it at the end of
    a chunk before, or all envelopes into chunks of their own.
    """

    def __init__(self, chunks: Sequence[ChunkSpan], envelopes: frozenset[int]) -> None:
        self._envelopes = envelopes
        self._ends_ns = {end_ns for each in chunks for end_ns in (each.first_ns, each.last_ns)}
        without = [each for each in chunks if not each.has_any(envelopes)]
        without.sort(key=lambda each: each.first_ns)
        self._first_ns = [each.first_ns for each in without]
        self._latest_ns = [*accumulate((each.last_ns for each in without), max)]

    def may_be_in(self, chunk: ChunkSpan) -> bool:
        """Return whether some of them may be in `chunk`."""
        if not chunk.has_any(self._envelopes):
            return False
        if not self._ends_ns.isdisjoint((chunk.first_ns, chunk.last_ns)):
            return True

        # Of those that begin before it ends, does one end after it begins?
        number = bisect_right(self._first_ns, chunk.last_ns)
        return number > 0 and self._latest_ns[number - 1] >= chunk.first_ns


class LogReader:
    """The log at `path`, or in the run's folder there. `cut_bytes` at its end belong to no whole
    record: it was cut off, or is being written.

    Raises LogError if it is missing, foreign, of a version that is not read here, or damaged;
    damage is found when the chunk concerned is read.
    """

    def __init__(self, path: Path) -> None:
        path = log_file(path)
        index = read_index(path)
        self.path = path
        self.size_bytes = path.stat().st_size
        self.channels = index.channels
        self.metadata = index.metadata
        self.cut_bytes = index.unreadable_bytes
        self._chunks = index.chunks
        self._indexed = {channel for each in index.chunks for channel in each.indexes or {}}
        self._cache: OrderedDict[int, list[Written]] = OrderedDict()
        self._cached_bytes = 0
        check_readable(path, index.library, self.about(layout.RECORDING).get("software", ""))

    def forget(self) -> None:
        """Free the memory of what was read; it is read again when it is asked for."""
        self._cache.clear()
        self._cached_bytes = 0

    def about(self, name: str) -> dict[str, str]:
        """Return the last metadata record called `name`, empty if there is none."""
        for found, facts in reversed(self.metadata):
            if found == name:
                return facts
        return {}

    @property
    def span_ns(self) -> tuple[int, int]:
        """Return the log times of the first and the last message, (0, 0) if there is none."""
        if not self._chunks:
            return 0, 0
        first_ns = min(chunk.first_ns for chunk in self._chunks)
        last_ns = max(chunk.last_ns for chunk in self._chunks)
        return first_ns, last_ns

    @property
    def span_s(self) -> float:
        """Return the seconds from the first message to the last."""
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
        """Yield messages on `topics`, on all known ones if it is None, in order of log time.

        Those of log times from `start_ns` (inclusive) to `end_ns` (exclusive); chunks without any
        are not read. Those of one time come as they were written. `progress` is called with the
        share of chunks that have been read. Raises LogError.
        """
        waiting: list[_Located] = []
        held = self._budget("holds, to be put in order,")
        numbers = self._numbers(topics, start_ns, end_ns)
        for done, number in enumerate(numbers, start=1):
            for position, message in enumerate(self._messages(number)):
                if start_ns <= message.log_time < end_ns:
                    order = message.log_time, self._chunks[number].offset, position
                    waiting.append(_Located(order, number, position, message))
            held.check(_size_of([each.message for each in waiting]))
            waiting.sort(key=_ORDER)

            # Chunks may overlap: what is as late as the next one's first message waits for it.
            ready = len(waiting)
            if done < len(numbers):
                next_begins: tuple[int, ...] = (self._chunks[numbers[done]].first_ns,)
                ready = bisect_left(waiting, next_begins, key=_ORDER)
            yield from self._with_envelopes(waiting[:ready], topics)
            del waiting[:ready]

            if progress is not None:
                progress(done / len(numbers))
        yield from self._with_envelopes(waiting, topics)

    def payloads(
        self, topics: Collection[Topic], *, start_ns: int = 0, end_ns: int = layout.MAX_TIME_NS + 1
    ) -> dict[Topic, list[tuple[int, bytes]]]:
        """Return the log time and the bytes of each message on each of `topics`, in order of log
        time.

        Of chunks that have an index only these messages are looked at, which `records` is five to
        ten times as slow as. Raises LogError.
        """
        named = {topic.name: topic for topic in topics}
        channels = self._channels_of(set(named))
        found: dict[Topic, list[tuple[tuple[int, int, int], bytes]]] = {each: [] for each in topics}
        held = self._budget("holds, of these topics,")
        with self.path.open("rb") as file:
            for number in self._numbers(topics, start_ns, end_ns):
                offset = self._chunks[number].offset
                messages = self._messages_on(set(named), file, number, channels)
                for position, message in enumerate(messages):
                    if start_ns <= message.log_time < end_ns:
                        order = message.log_time, offset, position
                        held.take(_MESSAGE_BYTES + len(message.data))
                        found[named[self._topic_name(message)]].append((order, message.data))

        payloads = {}
        for topic, located in found.items():
            located.sort(key=itemgetter(0))
            payloads[topic] = [(order[0], data) for order, data in located]
        return payloads

    def payload(self, record: Record) -> bytes:
        """Return the bytes of a message, as they travelled.

        This is quick if records are asked for roughly in order: the last few chunks are kept.
        Raises LogError.
        """
        message = self._messages(record.chunk)[record.position]
        data: bytes = message.data
        return data

    def message(self, record: Record) -> Message:
        """Return the message, decoded. Raises LogError; MessageError if it does not fit its
        topic.
        """
        return decode(record.topic, self.payload(record))

    def stub(self, record: Record) -> Message:
        """Return what every message has: its stamp, number and source. Raises LogError."""
        try:
            return _stub_decoder.decode(self.payload(record))
        except msgspec.DecodeError as error:
            topic = record.topic_name
            raise LogError(f"{self.path}: a message of {topic} cannot be read: {error}") from None

    def _with_envelopes(
        self, window: Sequence[_Located], topics: Collection[Topic] | None
    ) -> Iterator[Record]:
        """Give the messages of a window their envelopes. All messages of a log time are in one.

        An envelope has its message's log time and sequence. It is written before the message, but
        other programs may have put chunks between the two, or have changed their order.
        """
        envelopes: dict[tuple[int, int], list[bytes]] = defaultdict(list)
        for _, _, _, message in window:
            if self._topic_name(message) == layout.ENVELOPES:
                envelopes[message.log_time, message.sequence].append(message.data)

        for _, chunk, position, message in window:
            name = self._topic_name(message)
            topic = BY_NAME.get(name)
            if topic is None or (topics is not None and topic not in topics):
                continue
            yield Record(
                topic_name=name,
                channel=message.channel_id,
                sequence=message.sequence,
                log_time_ns=message.log_time,
                publish_ns=message.publish_time,
                envelope=_take(envelopes[message.log_time, message.sequence], name),
                chunk=chunk,
                position=position,
                size=len(message.data),
            )

    def _numbers(self, topics: Collection[Topic] | None, start_ns: int, end_ns: int) -> list[int]:
        """Return the numbers of the chunks in which messages on `topics`, of these times, or their
        envelopes may be.
        """
        within = [
            number
            for number, chunk in enumerate(self._chunks)
            if chunk.last_ns >= start_ns and chunk.first_ns < end_ns
        ]
        if topics is None:
            return within

        envelopes = self._channels_of({layout.ENVELOPES})
        wanted = self._channels_of({topic.name for topic in topics})
        chosen = {number for number in within if self._chunks[number].has_any(wanted)}
        search = EnvelopeSearch([self._chunks[number] for number in chosen], envelopes)
        return [
            number
            for number in within
            if number in chosen or search.may_be_in(self._chunks[number])
        ]

    def _channels_of(self, names: set[str]) -> frozenset[int]:
        """Return the numbers of the channels of topics with these names, and of those that only a
        later chunk declares: they may be of any topic.
        """
        found = {channel.id for channel in self.channels.values() if channel.topic in names}
        return frozenset(found | (self._indexed - self.channels.keys()))

    def _messages_on(
        self, names: set[str], file: BinaryIO, number: int, channels: frozenset[int]
    ) -> list[Written]:
        """Return the messages in a chunk on topics of these names, whose channels are among
        `channels`; those of a topic in the order in which they were written.
        """
        chunk = self._chunks[number]
        if chunk.indexes is None or not channels <= self.channels.keys():
            return [each for each in self._messages(number) if self._topic_name(each) in names]

        try:
            return read_messages(file, chunk, channels)
        except DamageError as error:
            raise self._damaged(chunk, error) from None

    def _budget(self, doing: str) -> Budget:
        return Budget(self.path, doing, most_unpacked(self.size_bytes, _HELD_BYTES))

    def _damaged(self, chunk: ChunkSpan, error: DamageError) -> LogError:
        return LogError(
            f"{self.path}: the chunk at byte {chunk.offset} is damaged ({error}): "
            f"`cogmap log recover {self.path} OUT` saves the rest"
        )

    def _topic_name(self, message: Written) -> str:
        """Return the topic of a message's channel, empty if nothing declares that channel."""
        channel = self.channels.get(message.channel_id)
        return "" if channel is None else channel.topic

    def _messages(self, number: int) -> list[Written]:
        """Return the messages in a chunk, envelopes among them, from the cache if they are
        there.
        """
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
        self._cached_bytes += _size_of(messages)
        while self._cached_bytes > _CACHED_BYTES and len(self._cache) > 1:
            _, oldest = self._cache.popitem(last=False)
            self._cached_bytes -= _size_of(oldest)
        return messages


def _size_of(messages: Sequence[Written]) -> int:
    """Return how many bytes messages take."""
    return sum(_MESSAGE_BYTES + len(message.data) for message in messages)


def _take(candidates: list[bytes], topic_name: str) -> Envelope | None:
    """Take the first envelope of a topic from candidates; None if there is none."""
    for number, content in enumerate(candidates):
        # The search alone tells most topics apart, for a fraction of what decoding costs.
        if topic_name.encode() not in content:
            continue
        try:
            record = _envelope_decoder.decode(content)
        except msgspec.DecodeError:
            continue
        if record.topic == topic_name:
            del candidates[number]
            return record.envelope()
    return None
