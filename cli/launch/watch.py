"""Follows a run on its bus: the drive, the graph, how long the cycle takes, how the processes fare."""

from __future__ import annotations

import time
from collections import Counter, deque

from cli.launch.observer import Observer
from cli.launch.plan import OBSERVER
from cogmap.bus.codec import Envelope
from cogmap.bus.interface import Arrival, Bus, Member
from cogmap.errors import MessageError
from cogmap.graph.replica import Replica, snapshot_over
from cogmap.runtime.inbox import Inbox
from cogmap.runtime.intake import Intake
from schemas import topics
from schemas.base import Message
from schemas.cognition import Broadcast
from schemas.graph import Delta
from schemas.process import Health
from schemas.sensing import MotorCommand
from schemas.topics import Delivery

TOLD = 8
FOLLOWED = (
    topics.TRUE_TOWN,
    topics.TRUE_POSE,
    topics.ODOMETRY,
    topics.DELTA,
    topics.MOTOR_COMMAND,
    topics.BROADCAST,
    topics.HEALTH,
)


class Watch:
    """An observer of the run on `bus`: `pump` it from one thread, `close` it in the end."""

    def __init__(self, bus: Bus) -> None:
        self.observer = Observer()
        self.replica = Replica(snapshot_over(bus))
        self.cycle_ms: list[float] = []
        self.bus_ms: list[float] = []
        self.broadcasts = 0
        self.dropped = 0
        self.refused: deque[str] = deque(maxlen=TOLD)
        self.halted: Counter[str] = Counter()
        self.health: dict[str, Health] = {}
        self.present: set[Member] = set()
        self._busy: dict[str, list[float]] = {}
        self._bus, self._inbox, self._intake = bus, Inbox(), Intake()
        for topic in FOLLOWED:
            bus.subscribe(topic, self._inbox.put, self._intake.count_lost)
        bus.watch(lambda member, alive: self._inbox.call(lambda: self._on_presence(member, alive)))
        bus.announce(Member(OBSERVER, OBSERVER))

    def pump(self, timeout_s: float) -> bool:
        """Take in all that has come, waiting up to `timeout_s` for the first. Whether it was more
        than health.
        """
        item = self._inbox.take(timeout_s)
        moved = False
        while item is not None:
            if isinstance(item, Arrival):
                moved |= item.topic is not topics.HEALTH
                self._receive(item)
            else:
                item()
            item = self._inbox.take(0.0)
        return moved

    def pump_until_quiet(self, quiet_s: float) -> None:
        """Take in what comes until for `quiet_s` there was nothing but news of the processes."""
        until_s = time.monotonic() + quiet_s
        while (left_s := until_s - time.monotonic()) > 0:
            if self.pump(left_s):
                until_s = time.monotonic() + quiet_s

    def _on_presence(self, member: Member, alive: bool) -> None:
        (self.present.add if alive else self.present.discard)(member)

    def _receive(self, arrival: Arrival) -> None:
        message = self._intake.accept(arrival)
        if message is None or arrival.envelope is None:
            return
        self.observer.take(message)
        try:
            self._follow(message, arrival.envelope, arrival.received_ns)
        except MessageError as error:
            self._intake.reject(arrival.topic.name, str(error))

    def _follow(self, message: Message, envelope: Envelope, received_ns: int) -> None:
        match message:
            case Delta():
                self.replica.follow(message)
                self.dropped += message.dropped
                self.refused.extend(message.refused)
            case Health():
                self.health[message.instance] = message
                self._busy.setdefault(message.instance, []).append(message.busy)
            case Broadcast():
                self.broadcasts += 1
            case MotorCommand():
                self._time(envelope, received_ns)
                if message.halted_by:
                    self.halted[message.halted_by] += 1

    def _time(self, envelope: Envelope, received_ns: int) -> None:
        cycle_ns = received_ns - envelope.born_ns
        compute_ns = sum(compute for _, compute, _ in envelope.stages)
        self.cycle_ms.append(cycle_ns / 1e6)
        self.bus_ms.append((cycle_ns - compute_ns) / 1e6)

    @property
    def busy(self) -> dict[str, float]:
        """The mean share of its time that each instance was at work."""
        return {
            instance: sum(shares) / len(shares) for instance, shares in sorted(self._busy.items())
        }

    def missing(self, awaited: dict[str, int]) -> list[str]:
        """The modules of which not all instances are ready yet."""
        ready = Counter(member.module for member in self.present)
        return [name for name, number in awaited.items() if ready[name] < number]

    def gaps(self) -> dict[str, int]:
        """Messages lost for good on each NEVER_DROP topic, by the count of whoever missed most."""
        counts = [self._intake.gaps, *(health.gaps for health in self.health.values())]
        never = [topic.name for topic in topics.ALL if topic.delivery is Delivery.NEVER_DROP]
        return {name: max(count.get(name, 0) for count in counts) for name in never}

    def rejected(self) -> dict[str, int]:
        """Messages that were not believed, by topic, summed over those who did not believe them."""
        total = self._intake.rejected.copy()
        for health in self.health.values():
            total.update(health.rejected)
        return dict(sorted(total.items()))

    def close(self) -> None:
        """Leave the bus."""
        self._bus.close()
