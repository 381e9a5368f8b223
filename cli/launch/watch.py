"""Follows a run on its bus: its messages, and which of its processes are ready."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping

import msgspec

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Arrival, Bus, Member
from cogmap.cli.launch.plan import OBSERVER
from cogmap.cli.launch.tally import FOLLOWED, Tally
from cogmap.graph.replica import Replica, snapshot_over
from cogmap.runtime.delivery.flood import Flood
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.delivery.plausibility import Plausibility
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Topic

PUBLISHED = (topics.OFFER, topics.STREET_CLOSURE)


class Watch:
    """An observer of the run on `bus`: `pump` it from one thread, `close` it in the end."""

    def __init__(self, bus: Bus) -> None:
        self.tally = Tally(Replica(snapshot_over(bus)))
        self.present: set[Member] = set()
        self._bus = bus
        self._inbox = Inbox()
        self._flood = Flood()
        self._intake = Intake(Plausibility())

        self._published: Counter[Topic] = Counter()
        self._incarnation = time.time_ns()
        for topic in PUBLISHED:
            bus.declare(topic)
        put = self._flood.before(self._inbox.put)
        for topic in FOLLOWED:
            bus.subscribe(topic, put, self._intake.count_lost)
        bus.watch(self._on_presence)
        bus.announce(Member(OBSERVER, OBSERVER))

    def _on_presence(self, member: Member, alive: bool) -> None:
        """Have the thread that pumps take account of who came or went."""
        change = self.present.add if alive else self.present.discard
        self._inbox.call(lambda: change(member))

    def pump(self, timeout_s: float) -> bool:
        """Receive all that has arrived, waiting up to `timeout_s` for the first. Returns False if
        none of it was of the drive: nothing, or only health.
        """
        item = self._inbox.take(timeout_s)
        moved = False
        while item is not None:
            if isinstance(item, Arrival):
                moved |= item.topic is not topics.HEALTH
                shed = self._flood.skipped(item)
                if shed is not None:
                    self._intake.resume(item.topic, shed)
                self.tally.receive(item, self._intake)
            else:
                item()
            item = self._inbox.take(0.0)
        return moved

    def pump_until_quiet(self, quiet_s: float) -> None:
        """Receive until for `quiet_s` nothing of the drive arrived."""
        until_s = time.monotonic() + quiet_s
        while (left_s := until_s - time.monotonic()) > 0:
            if self.pump(left_s):
                until_s = time.monotonic() + quiet_s

    def publish(self, message: Message) -> None:
        """Publish a message of one of the topics PUBLISHED."""
        topic = topics.of(message)
        number = self._published[topic]
        self._published[topic] += 1

        now_ns = time.time_ns()
        envelope = Envelope(OBSERVER, number, self._incarnation, now_ns, now_ns)
        numbered = msgspec.structs.replace(message, source=OBSERVER, seq=number)
        self._bus.publish(topic, encode(numbered), envelope)

    def missing(self, awaited: Mapping[str, int]) -> list[str]:
        """Return the modules of which not all instances are ready yet."""
        ready = Counter(member.module for member in self.present)
        return [name for name, number in awaited.items() if ready[name] < number]

    def gaps(self) -> dict[str, int]:
        """Count messages lost for good on each NEVER_DROP topic, by whoever lost most."""
        return self.tally.gaps(self._intake.gaps)

    def rejected(self) -> dict[str, int]:
        """Count messages that were rejected, by topic, summed over those who rejected them."""
        return self.tally.rejected(self._intake.rejected + self._flood.shed)

    def close(self) -> None:
        """Leave the bus."""
        self._bus.close()
