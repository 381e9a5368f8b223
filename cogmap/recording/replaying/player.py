"""Plays a log back onto a bus, as fast as it was recorded or at another rate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field
from time import monotonic, time_ns

import msgspec

from cogmap.bus.codec import Envelope
from cogmap.bus.interface import Bus, Member
from cogmap.errors import UsageError
from cogmap.recording.replaying.pacing import ClockPublisher, Control, Pacer
from cogmap.recording.selection import to_play
from cogmap.recording.storage.format import MAX_TIME_NS
from cogmap.recording.storage.reader import LogReader, Progress
from cogmap.schemas import topics
from cogmap.schemas.topics import Topic

SOURCE = "replay"
VIEWS = (topics.STEREO, topics.PERCEPTS)


@dataclass(frozen=True, kw_only=True)
class Choices:
    """How to play: `topics`, `rate` times as fast, from `start_offset_s` (inclusive) to `end_s`
    (exclusive) into the log, None its end, `clock_hz` (0: none) messages on the clock.
    """

    rate: float = 1.0
    topics: Collection[Topic] = field(default_factory=to_play)
    start_offset_s: float = 0.0
    end_s: float | None = None
    loop: bool = False
    clock_hz: float = 0.0


class Played(msgspec.Struct, kw_only=True):
    """What was played: messages by topic, rounds through the log, and the largest delay."""

    messages: dict[str, int]
    rounds: int
    wall_s: float
    late_max_s: float


class Player:
    """Publishes the messages of `reader` on `bus`, each when it is due.

    Raises UsageError if the rate is not above 0.
    """

    def __init__(self, reader: LogReader, bus: Bus, choices: Choices, control: Control) -> None:
        if choices.rate <= 0:
            raise UsageError(f"rate {choices.rate:g}: it must be above 0")

        self._reader = reader
        self._bus = bus
        self._choices = choices
        self._control = control
        self._pacer = Pacer(choices.rate, control)
        self._incarnations: dict[tuple[str, int], int] = {}
        self._played: Counter[str] = Counter()

        # What of the log is played, in the order of the table.
        recorded = {channel.topic for channel in reader.channels.values()}
        chosen = choices.topics
        self._topics = [each for each in topics.ALL if each.name in recorded and each in chosen]

        # A step ends with a view, as it is sensed or recognized; without any, with each message.
        views = [topic for topic in VIEWS if topic in self._topics and _has_any(reader, topic)]
        self._steps_by = views[:1] or self._topics

        self._clock: ClockPublisher | None = None
        if choices.clock_hz > 0:
            # The log's clock is not played beside the player's own.
            self._topics = [topic for topic in self._topics if topic is not topics.CLOCK]
            self._clock = ClockPublisher(bus, SOURCE, choices.rate, choices.clock_hz)

    def play(self, progress: Progress = lambda share: None) -> Played:
        """Play, until the end of the log or until asked to end; `progress` is called with the share
        of this round that is played.
        """
        for topic in self._topics:
            self._bus.declare(topic)
        self._bus.announce(Member(SOURCE, SOURCE))

        began_s = monotonic()
        rounds = 0
        while not self._control.asked and (self._choices.loop or rounds == 0):
            self._play_once(progress)
            rounds += 1
        return Played(
            messages=dict(self._played),
            rounds=rounds,
            wall_s=monotonic() - began_s,
            late_max_s=self._pacer.late_max_s,
        )

    def _play_once(self, progress: Progress) -> None:
        """Play the log once; the clock ends with its newest stamp.

        Each round is a new incarnation of every source, as its numbers begin anew.
        """
        self._incarnations.clear()
        begin_ns = self._reader.span_ns[0]
        start_ns = begin_ns + int(self._choices.start_offset_s * 1e9)
        end_s = self._choices.end_s
        end_ns = MAX_TIME_NS if end_s is None else begin_ns + int(end_s * 1e9)
        self._pacer.begin(start_ns)
        length_ns = max(1, min(end_ns, self._reader.span_ns[1]) - start_ns)

        for record in self._reader.records(self._topics, start_ns=start_ns, end_ns=end_ns):
            if not self._pacer.wait_until(record.log_time_ns, self._clock):
                return

            # The message travels in an envelope of today, which is as old as it was then.
            stub = self._reader.stub(record)
            then_ns = record.log_time_ns
            recorded = record.envelope or Envelope(stub.source, stub.seq, 0, then_ns, then_ns)
            now_ns = time_ns()
            age_ns = max(0, recorded.sent_ns - recorded.born_ns)
            key = (recorded.source, recorded.incarnation)
            renewed = Envelope(
                source=recorded.source,
                seq=recorded.seq,
                incarnation=self._incarnations.setdefault(key, now_ns),
                sent_ns=now_ns,
                born_ns=now_ns - age_ns,
                stages=recorded.stages,
                causes=recorded.causes,
            )
            self._bus.publish(record.topic, self._reader.payload(record), renewed)
            self._played[record.topic_name] += 1
            if record.topic in self._steps_by:
                self._pacer.end_step()
            progress((record.log_time_ns - start_ns) / length_ns)
            if self._clock is not None:
                self._clock.see(stub.stamp_ns)

        if self._clock is not None:
            self._clock.publish()


def _has_any(reader: LogReader, topic: Topic) -> bool:
    """Decide whether a log has messages on a topic: a channel alone may be empty."""
    return next(reader.records([topic]), None) is not None
