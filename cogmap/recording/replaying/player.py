"""Plays a log back onto a bus, as fast as it was recorded or at another rate."""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import dataclass
from typing import Protocol

import msgspec

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Bus, Member
from cogmap.errors import UsageError
from cogmap.recording.storage.reader import LogReader, Record
from schemas import topics
from schemas.process import Clock
from schemas.topics import About, Topic

SOURCE = "replay"


@dataclass(frozen=True, kw_only=True)
class Choices:
    """How to play: `rate` times as fast, from `start_offset_s` on, `clock_hz` (0: none) messages on
    the clock.

    `topics` None is every MODEL and TRUTH topic of the log: facts about processes are those of
    other ones.
    """

    rate: float = 1.0
    topics: Collection[Topic] | None = None
    start_offset_s: float = 0.0
    loop: bool = False
    clock_hz: float = 0.0


class Control(Protocol):
    """Whoever may stop or pause a player."""

    @property
    def asked(self) -> bool:
        """Whether to end."""

    @property
    def paused(self) -> bool:
        """Whether to stand still."""

    def wait(self, timeout_s: float) -> bool:
        """Wait so long, or until asked to end or to pause or go on; whether it is to end."""


class Played(msgspec.Struct, kw_only=True):
    """What was played: messages by topic, how often through the log, and how far behind time it
    fell at most.
    """

    messages: dict[str, int]
    rounds: int
    wall_s: float
    late_max_s: float


class Player:
    """Publishes the messages of `reader` on `bus`, each when it is due."""

    def __init__(self, reader: LogReader, bus: Bus, choices: Choices, control: Control) -> None:
        if choices.rate <= 0:
            raise UsageError(f"rate {choices.rate:g}: it must be above 0")
        self._reader = reader
        self._bus = bus
        self._choices = choices
        self._control = control
        self._pacer = _Pacer(choices.rate, control)
        self._topics = self._chosen()
        self._lives: dict[tuple[str, int], int] = {}
        self._played: dict[str, int] = {}
        self._clock = _ClockHand(bus, choices) if choices.clock_hz > 0 else None

    def play(self) -> Played:
        """Play, until the end of the log or until asked to end."""
        for topic in self._topics:
            self._bus.declare(topic)
        self._bus.announce(Member(SOURCE, SOURCE))
        began_s = time.monotonic()
        rounds = 0
        while not self._control.asked and (self._choices.loop or rounds == 0):
            self._round()
            rounds += 1
        return Played(
            messages=self._played,
            rounds=rounds,
            wall_s=time.monotonic() - began_s,
            late_max_s=self._pacer.late_max_s,
        )

    def _chosen(self) -> list[Topic]:
        recorded = {channel.topic for channel in self._reader.channels.values()}
        chosen = self._choices.topics
        return [
            topic
            for topic in topics.ALL
            if topic.name in recorded
            and (topic.about is not About.PROCESS if chosen is None else topic in chosen)
            and not (topic is topics.CLOCK and self._choices.clock_hz > 0)
        ]

    def _round(self) -> None:
        """Go once through the log. Each round is a new incarnation of every source, as its numbers
        begin anew.
        """
        self._lives.clear()
        start_ns = self._reader.span_ns[0] + int(self._choices.start_offset_s * 1e9)
        self._pacer.begin(start_ns)
        for record in self._reader.records(self._topics):
            if record.log_time_ns < start_ns:
                continue
            if not self._pacer.wait_until(record.log_time_ns, self._clock):
                return
            self._send(record)

    def _send(self, record: Record) -> None:
        stub = self._reader.stub(record)
        now_ns = time.time_ns()
        was = record.envelope or Envelope(
            stub.source, stub.seq, 0, record.log_time_ns, record.log_time_ns
        )
        life = self._lives.setdefault((was.source, was.incarnation), now_ns)
        born_ns = now_ns - max(0, was.sent_ns - was.born_ns)
        envelope = Envelope(was.source, was.seq, life, now_ns, born_ns, was.stages, was.causes)
        self._bus.publish(record.topic, self._reader.payload(record), envelope)
        self._played[record.topic_name] = self._played.get(record.topic_name, 0) + 1
        if self._clock is not None:
            self._clock.see(stub.stamp_ns)


class _ClockHand:
    """Says on the clock's topic the newest stamp that was played."""

    def __init__(self, bus: Bus, choices: Choices) -> None:
        bus.declare(topics.CLOCK)
        self._bus = bus
        self._rate = choices.rate
        self.period_ns = int(1e9 / choices.clock_hz)
        self._seq = self._stamp_ns = 0
        self._incarnation = time.time_ns()

    def see(self, stamp_ns: int) -> None:
        self._stamp_ns = max(self._stamp_ns, stamp_ns)

    def tell(self) -> None:
        clock = Clock(stamp_ns=self._stamp_ns, seq=self._seq, source=SOURCE, rate=self._rate)
        now_ns = time.time_ns()
        self._bus.publish(
            topics.CLOCK,
            encode(clock),
            Envelope(SOURCE, self._seq, self._incarnation, now_ns, now_ns),
        )
        self._seq += 1


class _Pacer:
    """Turns log time into waiting. Time stands still while paused."""

    def __init__(self, rate: float, control: Control) -> None:
        self._rate = rate
        self._control = control
        self._from_ns = self._began_ns = self._told_ns = 0
        self.late_max_s = 0.0

    def begin(self, log_time_ns: int) -> None:
        """Let `log_time_ns` be now."""
        self._from_ns, self._began_ns = log_time_ns, time.monotonic_ns()
        self._told_ns = 0

    def wait_until(self, log_time_ns: int, clock: _ClockHand | None) -> bool:
        """Wait until it is `log_time_ns`, with the clock going on meanwhile. False where asked to
        end.
        """
        due_ns = int((log_time_ns - self._from_ns) / self._rate)
        while not self._control.asked:
            now_ns = self._now_ns()
            if self._control.paused:
                self._control.wait(_PAUSE_S)
                self._began_ns += self._now_ns() - now_ns
                continue
            if clock is not None and now_ns >= self._told_ns:
                clock.tell()
                self._told_ns = max(self._told_ns + clock.period_ns, now_ns)
            if now_ns >= due_ns:
                self.late_max_s = max(self.late_max_s, (now_ns - due_ns) / 1e9)
                return True
            until_ns = due_ns if clock is None else min(due_ns, self._told_ns)
            self._control.wait(max(0, until_ns - now_ns) / 1e9)
        return False

    def _now_ns(self) -> int:
        return time.monotonic_ns() - self._began_ns


_PAUSE_S = 60.0
