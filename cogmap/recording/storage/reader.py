"""The one reader of logs: messages in (log time, channel, sequence) order, from a whole file or a
cut one.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata

from cogmap.bus.codec import Envelope, decode
from cogmap.errors import LogError
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.chunks import DamageError, Frame, LogFile, Piece, channels_in, pieces
from cogmap.recording.storage.format import EnvelopeRecord
from schemas.base import Message
from schemas.topics import BY_NAME, Topic

_CACHED_CHUNKS = 12
_envelope_decoder = msgspec.msgpack.Decoder(EnvelopeRecord)
_stub_decoder = msgspec.msgpack.Decoder(Message)
Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Record:
    """A message in a log: where its bytes are, and all that is known without decoding them."""

    topic_name: str
    channel: int
    sequence: int
    log_time_ns: int
    publish_ns: int
    envelope: Envelope | None
    chunk: int
    start: int
    end: int

    @property
    def topic(self) -> Topic:
        """The row of the table that it travelled on."""
        return BY_NAME[self.topic_name]

    @property
    def size(self) -> int:
        """Its bytes."""
        return self.end - self.start


class LogReader:
    """The log at `path`. `cut_bytes` at its end make no sense: it was cut off, or is being written.

    Raises LogError where it is missing, foreign or, while it is read, damaged.
    """

    def __init__(self, path: Path) -> None:
        self.file = LogFile(path)
        self.path = path
        self.size_bytes = self.file.size
        self.metadata: list[tuple[str, dict[str, str]]] = []
        self.channels: dict[int, Channel] = {}
        self._chunks: list[Frame] = []
        self._cache: OrderedDict[int, bytes] = OrderedDict()
        self.cut_bytes = 0
        try:
            self._survey()
        except DamageError as error:
            raise LogError(
                f"{path} is damaged: {error}; `cogmap log recover {path} OUT` saves what it can"
            ) from None

    def about(self, name: str) -> dict[str, str]:
        """The last metadata record called `name`, empty where there is none."""
        return next((facts for found, facts in reversed(self.metadata) if found == name), {})

    @property
    def span_ns(self) -> tuple[int, int]:
        """The log times of the first and the last message, (0, 0) where there is none."""
        times = [self.file.times_ns(chunk) for chunk in self._chunks]
        return (
            (min(first for first, _ in times), max(last for _, last in times)) if times else (0, 0)
        )

    @property
    def span_s(self) -> float:
        """Seconds from the first message to the last."""
        first_ns, last_ns = self.span_ns
        return (last_ns - first_ns) / 1e9

    def records(
        self, topics: Collection[Topic] | None = None, progress: Progress | None = None
    ) -> Iterator[Record]:
        """Messages on `topics`, all known ones where it is None, in order; `progress` is told the
        share done.
        """
        waiting: list[Record] = []
        starts_ns = [self.file.times_ns(chunk)[0] for chunk in self._chunks]
        for index in range(len(self._chunks)):
            waiting += self._in_chunk(index, topics)
            waiting.sort(key=_order)
            later_ns = (
                starts_ns[index + 1] if index + 1 < len(starts_ns) else layout.MAX_TIME_NS + 1
            )
            ready = next(
                (n for n, record in enumerate(waiting) if record.log_time_ns >= later_ns),
                len(waiting),
            )
            yield from waiting[:ready]
            del waiting[:ready]
            if progress is not None:
                progress((index + 1) / len(self._chunks))

    def payload(self, record: Record) -> bytes:
        """The bytes of a message, as they travelled. Quick where records are asked for roughly in
        order.
        """
        return self._data(record.chunk)[record.start : record.end]

    def message(self, record: Record) -> Message:
        """The message, decoded. Raises MessageError where it is not what its topic carries."""
        return decode(record.topic, self.payload(record))

    def stub(self, record: Record) -> Message:
        """What every message has, of this one: its stamp, number and source. Raises LogError where
        it has not.
        """
        try:
            return _stub_decoder.decode(self.payload(record))
        except msgspec.DecodeError as error:
            raise LogError(
                f"{self.path}: a message of {record.topic.name} cannot be read: {error}"
            ) from None

    def _survey(self) -> None:
        end = 0
        for frame in self.file.frames():
            end = frame.end
            if frame.opcode == Opcode.CHUNK:
                self._chunks.append(frame)
            record = self.file.parse(frame)
            if isinstance(record, Header) and record.profile != layout.PROFILE:
                raise LogError(
                    f"{self.path} is not one of our logs: its profile is {record.profile!r}"
                )
            if isinstance(record, Channel):
                self.channels[record.id] = record
            elif isinstance(record, Metadata):
                self.metadata.append((record.name, record.metadata))
            if frame.opcode == Opcode.FOOTER:
                end = self.size_bytes
        self.cut_bytes = self.size_bytes - end
        self._chunks.sort(key=lambda chunk: (self.file.times_ns(chunk), chunk.offset))
        if self._chunks and not self.channels:
            first = min(range(len(self._chunks)), key=lambda index: self._chunks[index].offset)
            self._declare(self._data(first))

    def _declare(self, data: bytes) -> None:
        self.channels |= {channel.id: channel for channel in channels_in(data)}

    def _in_chunk(self, index: int, topics: Collection[Topic] | None) -> Iterator[Record]:
        """The messages of one chunk, each with the envelope that was written just before it."""
        data = self._data(index, check=True)
        told: tuple[Piece, EnvelopeRecord] | None = None
        for piece in self._pieces(index, data):
            if piece.channel not in self.channels:
                self._declare(data)
            channel = self.channels.get(piece.channel)
            name = "" if channel is None else channel.topic
            if name == layout.ENVELOPES:
                told = _told(piece, data)
                continue
            topic = BY_NAME.get(name)
            if topic is not None and (topics is None or topic in topics):
                yield Record(
                    name,
                    piece.channel,
                    piece.sequence,
                    piece.log_time_ns,
                    piece.publish_ns,
                    _matching(told, piece, name),
                    index,
                    piece.start,
                    piece.end,
                )
            told = None

    def _pieces(self, index: int, data: bytes) -> Iterator[Piece]:
        try:
            yield from pieces(data)
        except DamageError as error:
            raise self._damaged(index, error) from None

    def _damaged(self, index: int, error: DamageError) -> LogError:
        return LogError(
            f"{self.path}: the chunk at byte {self._chunks[index].offset} is damaged ({error}): "
            f"`cogmap log recover {self.path} OUT` saves the rest"
        )

    def _data(self, index: int, check: bool = False) -> bytes:
        cached = self._cache.get(index)
        if cached is not None:
            self._cache.move_to_end(index)
            return cached
        try:
            data = self.file.data(self._chunks[index], check)
        except DamageError as error:
            raise self._damaged(index, error) from None
        self._cache[index] = data
        if len(self._cache) > _CACHED_CHUNKS:
            self._cache.popitem(last=False)
        return data


def _order(record: Record) -> tuple[int, int, int]:
    return record.log_time_ns, record.channel, record.sequence


def _told(piece: Piece, data: bytes) -> tuple[Piece, EnvelopeRecord] | None:
    try:
        return piece, _envelope_decoder.decode(data[piece.start : piece.end])
    except msgspec.DecodeError:
        return None


def _matching(
    told: tuple[Piece, EnvelopeRecord] | None, piece: Piece, name: str
) -> Envelope | None:
    if told is None:
        return None
    before, record = told
    same = (before.log_time_ns, before.sequence, record.topic) == (
        piece.log_time_ns,
        piece.sequence,
        name,
    )
    return record.envelope() if same else None
