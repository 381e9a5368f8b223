"""Finds the messages of one cognitive cycle in a log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from cogmap.recording.log import Entry, Log
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Action, Broadcast, Coalition, Coalitions, Competition
from cogmap.schemas.graph import Delta
from cogmap.schemas.sensing import MotorCommand
from cogmap.schemas.topics import Topic

M = TypeVar("M", bound=Message)
OfCycle = TypeVar("OfCycle", Delta, Coalitions, Competition, Broadcast, Action)
CYCLES_BACK = 8


@dataclass(frozen=True)
class Logged(Generic[M]):
    """A message of a log.

    `time_s` is when it was received, in seconds since the log's first message; `after_ms` how long
    after the sensing of the cycle's view it was sent, None where the log does not say.
    """

    message: M
    time_s: float
    after_ms: float | None


@dataclass(frozen=True)
class Entered:
    """A coalition as it entered the competition, in cycle `cycle`."""

    cycle: int
    coalition: Coalition


class Reading:
    """The messages of cycle `cycle`, whose view is of `stamp_ns`. All raise LogError."""

    def __init__(self, log: Log, cycle: int, stamp_ns: int) -> None:
        self._log = log
        self._cycle = cycle
        self._stamp_ns = stamp_ns
        self._born_ns = self._sensed_ns()

    def of_view(self, kind: type[M]) -> Logged[M] | None:
        """Find the first message with the stamp of the cycle's view."""
        entry = self._first_of_view(topics.BY_TYPE[kind])
        return None if entry is None else self._logged(kind, entry)

    def of_cycle(self, kind: type[OfCycle]) -> Logged[OfCycle] | None:
        """Find the message of the cycle."""
        found = self._last(kind, lambda message: message.cycle <= self._cycle)
        if found is None or found.message.cycle != self._cycle:
            return None
        return found

    def before_cycle(self, kind: type[OfCycle]) -> Logged[OfCycle] | None:
        """Find the last message of the cycles before."""
        return self._last(kind, lambda message: message.cycle < self._cycle)

    def deltas(self) -> list[Logged[Delta]]:
        """List what the cycle committed, in order."""
        before = self.before_cycle(Delta)
        start_s = 0.0 if before is None else before.time_s

        found = []
        for entry in self._log.messages(topics.DELTA.name, start_s=start_s):
            delta = self._logged(Delta, entry)
            if delta.message.cycle > self._cycle:
                break
            if delta.message.cycle == self._cycle:
                found.append(delta)
        return found

    def entered(self, competition: Logged[Competition] | None) -> dict[str, Entered]:
        """Find the coalitions of a competition, by id, if the log holds their first cycle."""
        if competition is None:
            return {}

        wanted = {contender.id for contender in competition.message.contenders}
        back = CYCLES_BACK
        while True:
            found = self._entered_since(self._cycle - back)
            if wanted <= found.keys() or back >= self._cycle:
                return {name: entered for name, entered in found.items() if name in wanted}
            back *= CYCLES_BACK

    def command(self, action: Logged[Action] | None) -> Logged[MotorCommand] | None:
        """Find the first command after `action`; if that is None, the answer to the view."""
        if action is None:
            return self.of_view(MotorCommand)

        names = topics.ACTION.name, topics.MOTOR_COMMAND.name
        is_selected = False
        for entry in self._log.messages(*names, start_s=action.time_s):
            if isinstance(entry.message, Action):
                is_selected = is_selected or entry.message.cycle == self._cycle
            elif is_selected:
                return self._logged(MotorCommand, entry)
        return None

    def _entered_since(self, first: int) -> dict[str, Entered]:
        """Collect every coalition that entered after cycle `first`, up to this cycle."""
        name = topics.COALITIONS.name
        before = self._log.last(name, lambda message: message.cycle <= first)
        start_s = 0.0 if before is None else before.time_s

        found: dict[str, Entered] = {}
        for entry in self._log.messages(name, start_s=start_s):
            message = entry.message
            assert isinstance(message, Coalitions)
            if message.cycle > self._cycle:
                break
            for coalition in message.coalitions:
                found[name_of(coalition, message.cycle)] = Entered(message.cycle, coalition)
        return found

    def _sensed_ns(self) -> int | None:
        """Find when the view was sensed, by the wall clock; None if the log does not say."""
        for topic in (topics.PERCEPTS, topics.COMPETITION):
            entry = self._first_of_view(topic)
            if entry is not None and entry.envelope is not None:
                return entry.envelope.born_ns
        return None

    def _first_of_view(self, topic: Topic) -> Entry | None:
        before = self._log.last(topic.name, lambda message: message.stamp_ns < self._stamp_ns)
        start_s = 0.0 if before is None else before.time_s
        for entry in self._log.messages(topic.name, start_s=start_s):
            if entry.message.stamp_ns == self._stamp_ns:
                return entry
            if entry.message.stamp_ns > self._stamp_ns:
                break
        return None

    def _last(self, kind: type[M], holds: Callable[[M], bool]) -> Logged[M] | None:
        entry = self._log.last(topics.BY_TYPE[kind].name, holds)
        return None if entry is None else self._logged(kind, entry)

    def _logged(self, kind: type[M], entry: Entry) -> Logged[M]:
        message = entry.message
        assert isinstance(message, kind)
        after_ms = None
        if entry.envelope is not None and self._born_ns is not None:
            after_ms = (entry.envelope.sent_ns - self._born_ns) / 1e6
        return Logged(message, entry.time_s, after_ms)


def name_of(coalition: Coalition, cycle: int) -> str:
    """Return the id by which the global workspace calls a coalition that entered in `cycle`."""
    return coalition.id or f"{coalition.codelet}/{cycle}"
