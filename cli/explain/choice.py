"""Which cycle of a log is meant: by its number, by a time of the log, or the last broadcast."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from cogmap.errors import LogError, UsageError
from cogmap.recording.log import Log
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Broadcast, Competition
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.topics import Topic

CYCLES = (topics.DELTA, topics.COMPETITION)
BACK_S = 2.0
"""Some ten cycles; where there is none, further back is searched."""

SHOWN_S = 0.0005
"""Times are shown to the millisecond: one that is copied means what it was shown for."""

NEEDED = (topics.BROADCAST, topics.ACTION)


@dataclass(frozen=True)
class Cycle:
    """A cycle, and the stamp of its view."""

    number: int
    stamp_ns: int


@dataclass(frozen=True)
class Covered:
    """The numbers of the first cycle of a log and of the last, and when, in seconds into the log,
    the first was begun and the log ends.
    """

    first: int
    last: int
    begin_s: float
    end_s: float

    def __str__(self) -> str:
        return (
            f"{self.begin_s:.3f} s to {self.end_s:.3f} s of its time, "
            f"cycles {self.first} to {self.last}"
        )


def require_decisions(log: Log) -> None:
    """Raise LogError if `log` has no broadcast, or no action: it decides nothing."""
    missing = {topic.name for topic in NEEDED}
    for entry in log.messages(*missing):
        missing.discard(entry.topic)
        if not missing:
            return

    names = " and no ".join(topic.name for topic in NEEDED if topic.name in missing)
    raise LogError(
        f"{log.path} holds no {names}, so nothing is to be explained: "
        f"`cogmap log info {log.path}` shows what it holds"
    )


def last_broadcast(log: Log) -> Cycle:
    """Find the cycle of the last broadcast. Raises LogError if there is none."""
    entry = log.last(topics.BROADCAST.name, lambda _message: True)
    if entry is None:
        raise LogError(f"{log.path} holds no {topics.BROADCAST.name}")

    message = entry.message
    assert isinstance(message, Broadcast)
    return Cycle(message.cycle, message.stamp_ns)


def at_time(log: Log, at_s: float) -> Cycle:
    """Find the newest cycle of which something was received by `at_s` into the log. Raises
    UsageError.
    """
    found = None
    back_s = BACK_S
    while found is None and at_s <= log.duration_s:
        recent = _cycles(log, *CYCLES, start_s=at_s - back_s, end_s=at_s + SHOWN_S)
        found = max(recent, key=lambda cycle: cycle.number, default=None)
        if back_s > at_s:
            break
        back_s *= 2

    if found is None:
        covered = _covered(log)
        raise UsageError(f"{log.path} covers {covered}: choose a time of these, not {at_s:g} s")
    return found


def numbered(log: Log, number: int) -> Cycle:
    """Find the cycle with that number. Raises UsageError, which names those that there are."""
    found = _of_number(log, number)
    if found is None:
        covered = _covered(log)
        raise UsageError(f"{log.path} covers {covered}: choose one of these, not cycle {number}")
    return found


def _of_number(log: Log, number: int) -> Cycle | None:
    for topic in CYCLES:
        before = log.last(topic.name, lambda message: message.cycle < number)
        start_s = 0.0 if before is None else before.time_s
        for cycle in _cycles(log, topic, start_s=start_s):
            if cycle.number == number:
                return cycle
            if cycle.number > number:
                break
    return None


def _covered(log: Log) -> Covered:
    """Find the first and the last cycle of a log. Raises LogError if it holds none."""
    first = next(log.messages(*CYCLES), None)
    if first is None:
        names = " and no ".join(topic.name for topic in CYCLES)
        raise LogError(
            f"{log.path} holds no {names}: `cogmap log info {log.path}` shows what it holds"
        )

    oldest = _cycle_of(first.message).number
    newest = oldest
    for topic in CYCLES:
        entry = log.last(topic, lambda _message: True)
        if entry is not None:
            newest = max(newest, _cycle_of(entry.message).number)
    return Covered(oldest, newest, first.time_s, log.duration_s)


def _cycles(
    log: Log, *wanted: Topic, start_s: float = 0.0, end_s: float | None = None
) -> Iterator[Cycle]:
    """Yield the cycle of each message but late answers, whose stamp is that of another cycle."""
    for entry in log.messages(*wanted, start_s=start_s, end_s=end_s):
        message = entry.message
        if isinstance(message, Delta) and message.phase is Phase.LATE:
            continue
        yield _cycle_of(message)


def _cycle_of(message: Message) -> Cycle:
    assert isinstance(message, Delta | Competition)
    return Cycle(message.cycle, message.stamp_ns)
