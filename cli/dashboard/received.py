"""What was received of a system lately, from which the parts of the page are made. Pure."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from cogmap.bus.codec import Envelope
from cogmap.cli.explain.reading import Entered, Logged, name_of
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Action, Broadcast, Coalitions, Competition
from cogmap.schemas.graph import Delta
from cogmap.schemas.process import Health
from cogmap.schemas.sensing import MotorCommand, Percepts, Pose, TruePose
from cogmap.schemas.topics import Topic

COMPETITIONS = 80
"""Competitions of the timeline: 16 s of the default's five a second."""

RECENT = 400
"""Messages in which those of the cycle that is explained are looked for."""

COMMANDS = 50
"""Motor commands of which the median latency is shown: 10 s of the default's five a second."""

TRUE_STEP_M = 0.5
EXPLAINED = (Percepts, Delta, Coalitions, Competition, Broadcast, Action, MotorCommand)


class Arrived(NamedTuple):
    """A message, with what is known of its way."""

    message: Message
    envelope: Envelope | None
    received_ns: int

    def logged(self) -> Logged[Any]:
        """Return it as an explanation needs it."""
        after_ms = None
        if self.envelope is not None:
            after_ms = (self.envelope.sent_ns - self.envelope.born_ns) / 1e6
        return Logged(self.message, self.received_ns / 1e9, after_ms)


@dataclass
class Received:
    """The newest message of each topic, how many came, and the last few of those that are shown in
    a row. `start` is the true pose in which the agent began, None if that was not received.
    """

    newest: dict[Topic, Arrived] = field(default_factory=dict)
    counts: Counter[Topic] = field(default_factory=Counter)
    explained: deque[Logged[Any]] = field(default_factory=lambda: deque(maxlen=RECENT))
    entered: dict[str, Entered] = field(default_factory=dict)
    competitions: deque[Competition] = field(default_factory=lambda: deque(maxlen=COMPETITIONS))
    broadcasts: deque[Broadcast] = field(default_factory=lambda: deque(maxlen=COMPETITIONS))
    commands: deque[Arrived] = field(default_factory=lambda: deque(maxlen=COMMANDS))
    health: dict[str, Arrived] = field(default_factory=dict)
    start: Pose | None = None
    true_path_m: list[tuple[float, float]] = field(default_factory=list)

    def copy(self) -> Received:
        """Return the same without its view, which is large. Messages are shared: none changes."""
        newest = dict(self.newest)
        newest.pop(topics.VIEW, None)
        return Received(
            newest=newest,
            counts=self.counts.copy(),
            explained=self.explained.copy(),
            entered=dict(self.entered),
            competitions=self.competitions.copy(),
            broadcasts=self.broadcasts.copy(),
            commands=self.commands.copy(),
            health=dict(self.health),
            start=self.start,
            true_path_m=list(self.true_path_m),
        )

    def add(self, topic: Topic, arrived: Arrived) -> None:
        """Take account of one message."""
        message = arrived.message
        self.newest[topic] = arrived
        self.counts[topic] += 1
        if isinstance(message, EXPLAINED):
            self.explained.append(arrived.logged())

        match message:
            case Coalitions():
                for coalition in message.coalitions:
                    name = name_of(coalition, message.cycle)
                    self.entered[name] = Entered(message.cycle, coalition)
                while len(self.entered) > RECENT:
                    del self.entered[next(iter(self.entered))]
            case Competition():
                self.competitions.append(message)
            case Broadcast():
                self.broadcasts.append(message)
            case MotorCommand() if arrived.envelope is not None:
                self.commands.append(arrived)
            case Health():
                self.health[message.instance] = arrived
            case TruePose():
                self._follow_truth(message)

    def message(self, topic: Topic) -> Message | None:
        """Return the newest message on a topic; None if there was none."""
        arrived = self.newest.get(topic)
        return None if arrived is None else arrived.message

    def _follow_truth(self, true: TruePose) -> None:
        """Follow the true path, if it is known from its beginning."""
        if self.start is None and true.seq == 0:
            self.start = true.pose
        if self.start is None:
            return

        at_m = (true.pose.x_m, true.pose.y_m)
        if self.true_path_m:
            x_m, y_m = np.subtract(at_m, self.true_path_m[-1])
            if np.hypot(x_m, y_m) < TRUE_STEP_M:
                return
        self.true_path_m.append(at_m)
