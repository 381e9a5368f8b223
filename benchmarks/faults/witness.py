"""Receives all that a drive publishes and must not lose, and when its commands came."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass, field

from cogmap.bus.codec import Envelope, decode, encode
from cogmap.bus.interface import Arrival, Member
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import NoAnswerError
from cogmap.graph.graph import Graph
from cogmap.graph.replica import Replica, snapshot_over
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta, Snapshot, SnapshotRequest
from cogmap.schemas.memory import Stored
from cogmap.schemas.process import Pause
from cogmap.schemas.sensing import MotorCommand
from cogmap.schemas.topics import Delivery, Topic

INSTANCE = "campaign"
ANSWER_S = 10.0
WATCHED = tuple(topic for topic in topics.ALL if topic.delivery is Delivery.NEVER_DROP)

Identity = tuple[str, str, int, int]
"""A message, by its topic, source, incarnation and number."""


def identity(topic: Topic, envelope: Envelope) -> Identity:
    """Return which message that is."""
    return topic.name, envelope.source, envelope.incarnation, envelope.seq


@dataclass
class Seen:
    """What a witness has received. `received_ns` is of every message; deltas are by version."""

    received_ns: dict[Identity, int] = field(default_factory=dict)
    deltas: dict[int, bytes] = field(default_factory=dict)
    stored: list[Stored] = field(default_factory=list)
    commands_s: list[float] = field(default_factory=list)


class Witness:
    """An observer of the drive at `endpoint`: `pump` it from one thread, `close` it in the end."""

    def __init__(self, endpoint: str, agent: str) -> None:
        self.seen = Seen()
        self.present: Counter[str] = Counter()
        self._bus = ZenohBus(endpoint, agent)
        self._replica = Replica(snapshot_over(self._bus))
        self._inbox = Inbox()
        self._intake = Intake()
        self._newest_ns = -1
        self._published = 0
        self._incarnation = time.time_ns()

        self._bus.declare(topics.PAUSE)
        for topic in WATCHED:
            self._bus.subscribe(topic, self._inbox.put, self._intake.count_lost)
        self._bus.watch(self._on_presence)

    @property
    def digest(self) -> str:
        """Return the digest of the graph, as followed."""
        return self._replica.graph.digest()

    def pump(self, timeout_s: float) -> bool:
        """Receive all that has arrived, waiting up to `timeout_s` for the first. Returns whether
        any of it was a message.
        """
        item = self._inbox.take(timeout_s)
        moved = False
        while item is not None:
            if isinstance(item, Arrival):
                moved |= item.topic.scope is not topics.Scope.PROCESS
                self._receive(item)
            else:
                item()
            item = self._inbox.take(0.0)
        return moved

    def pump_until_quiet(self, quiet_s: float, limit_s: float) -> bool:
        """Receive until nothing has arrived for `quiet_s`. Returns whether that was so within
        `limit_s`.
        """
        limit_at_s = time.monotonic() + limit_s
        until_s = time.monotonic() + quiet_s
        while (left_s := until_s - time.monotonic()) > 0:
            if time.monotonic() > limit_at_s:
                return False
            if self.pump(left_s):
                until_s = time.monotonic() + quiet_s
        return True

    def pause(self) -> None:
        """Let time stand."""
        now_ns = time.time_ns()
        message = Pause(is_paused=True, source=INSTANCE, seq=self._published)
        envelope = Envelope(INSTANCE, self._published, self._incarnation, now_ns, now_ns)
        self._published += 1
        self._bus.publish(topics.PAUSE, encode(message), envelope)

    def snapshot(self) -> Graph | None:
        """Return the workspace's graph; None if it does not answer."""
        try:
            answer = self._bus.query(topics.SNAPSHOT_REQUEST, encode(SnapshotRequest()), ANSWER_S)
        except NoAnswerError:
            return None

        snapshot = decode(topics.SNAPSHOT, answer.payload)
        assert isinstance(snapshot, Snapshot)
        graph = Graph()
        graph.load(snapshot)
        return graph

    def close(self) -> None:
        """Leave the bus."""
        self._bus.close()

    def _on_presence(self, member: Member, alive: bool) -> None:
        def note() -> None:
            self.present[member.instance] += alive

        self._inbox.call(note)

    def _receive(self, arrival: Arrival) -> None:
        message = self._intake.accept(arrival)
        envelope = arrival.envelope
        if message is None or envelope is None:
            return

        self.seen.received_ns[identity(arrival.topic, envelope)] = arrival.received_ns
        match message:
            case Delta():
                self.seen.deltas[message.version] = bytes(arrival.payload)
                self._replica.follow(message, envelope.incarnation)
            case Stored():
                self.seen.stored.append(message)
            case MotorCommand() if message.stamp_ns > self._newest_ns:
                self._newest_ns = message.stamp_ns
                self.seen.commands_s.append(time.monotonic())
