"""Which cycle of a log is meant: by its number, by a time of the drive, or the last broadcast."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from cogmap.errors import LogError, UsageError
from cogmap.recording.log import Log
from cogmap.schemas import topics
from cogmap.schemas.cognition import Broadcast, Competition
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.topics import Topic

CYCLES = (topics.DELTA, topics.COMPETITION)
NEEDED = (topics.BROADCAST, topics.ACTION)


@dataclass(frozen=True)
class Cycle:
    """A cycle, and the stamp of its view."""

    number: int
    stamp_ns: int


@dataclass(frozen=True)
class Covered:
    """The first cycle of a log and the last."""

    first: Cycle
    last: Cycle

    def __str__(self) -> str:
        first, last = self.first, self.last
        return (
            f"{first.stamp_ns / 1e9:.3f} s to {last.stamp_ns / 1e9:.3f} s of the drive, "
            f"cycles {first.number} to {last.number}"
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
    """Find the last cycle whose view is at or before `at_s` of the drive. Raises UsageError."""
    at_ns = round(at_s * 1e9)
    covered = _covered(log)
    if not covered.first.stamp_ns <= at_ns <= covered.last.stamp_ns:
        raise UsageError(f"{log.path} covers {covered}: choose a time of these, not {at_s:g} s")

    anchor = log.last(topics.COMPETITION.name, lambda message: message.stamp_ns <= at_ns)
    found = covered.first
    start_s = 0.0
    if anchor is not None:
        competition = anchor.message
        assert isinstance(competition, Competition)
        found = Cycle(competition.cycle, competition.stamp_ns)
        start_s = anchor.time_s

    # A cycle that ended at its deadline has deltas but no competition.
    for cycle in _cycles(log, topics.DELTA, start_s=start_s):
        if cycle.stamp_ns > at_ns:
            break
        found = max(found, cycle, key=lambda each: each.number)
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
    first = next(_cycles(log, *CYCLES), None)
    if first is None:
        names = " and no ".join(topic.name for topic in CYCLES)
        raise LogError(
            f"{log.path} holds no {names}: `cogmap log info {log.path}` shows what it holds"
        )

    newest = first.number
    for topic in CYCLES:
        entry = log.last(topic.name, lambda _message: True)
        if entry is not None:
            message = entry.message
            assert isinstance(message, Delta | Competition)
            newest = max(newest, message.cycle)
    return Covered(first, _of_number(log, newest) or first)


def _cycles(log: Log, *wanted: Topic, start_s: float = 0.0) -> Iterator[Cycle]:
    """Yield the cycle of each message but late answers, whose stamp is that of another cycle."""
    for entry in log.messages(*[topic.name for topic in wanted], start_s=start_s):
        message = entry.message
        assert isinstance(message, Delta | Competition)
        if isinstance(message, Delta) and message.phase is Phase.LATE:
            continue
        yield Cycle(message.cycle, message.stamp_ns)
