"""Judges what arrives: believed, or counted and named."""

from __future__ import annotations

import logging
import time
from collections import Counter

from cogmap.bus.codec import decode
from cogmap.bus.interface import Arrival
from cogmap.errors import MessageError
from schemas.base import Message
from schemas.topics import Delivery, Topic

log = logging.getLogger("cogmap")
LOG_INTERVAL_S = 1.0


class Intake:
    """Decodes arrivals and keeps count of the received, the rejected and the lost of each topic."""

    def __init__(self) -> None:
        self.received: Counter[str] = Counter()
        self.rejected: Counter[str] = Counter()
        self.gaps: Counter[str] = Counter()
        self._missing: Counter[str] = Counter()
        self._given_up: Counter[str] = Counter()
        self._last: dict[tuple[Topic, str], tuple[int, int]] = {}
        self._quiet_until: dict[str, float] = {}
        self._suppressed: Counter[str] = Counter()

    def accept(self, arrival: Arrival) -> Message | None:
        """The message in `arrival`, or None where it is not one or came before."""
        topic = arrival.topic
        try:
            message = decode(topic, arrival.payload)
            self._follow(arrival, message)
        except MessageError as error:
            self.reject(topic.name, str(error))
            return None
        self.received[topic.name] += 1
        return message

    def _follow(self, arrival: Arrival, message: Message) -> None:
        """Keep track of the numbers of each NEVER_DROP source, which starts anew with each
        incarnation.
        """
        envelope = arrival.envelope
        if envelope is None:
            raise MessageError(f"{arrival.topic.name}: no envelope")
        if (envelope.source, envelope.seq) != (message.source, message.seq):
            raise MessageError(f"{arrival.topic.name}: envelope and message name different sources")
        if arrival.topic.delivery is not Delivery.NEVER_DROP:
            return
        key = (arrival.topic, message.source)
        incarnation, last = self._last.get(key, (0, -1))
        if incarnation == envelope.incarnation:
            if message.seq <= last:
                raise MessageError(
                    f"{arrival.topic.name}: number {message.seq} of {message.source} came twice"
                )
            if message.seq > last + 1:
                self._missing[arrival.topic.name] += message.seq - last - 1
                self._count_gaps(arrival.topic.name)
        self._last[key] = (envelope.incarnation, message.seq)

    def count_lost(self, topic: str, number: int) -> None:
        """Take note that the bus gave up `number` messages of `topic`; called from its threads."""
        self._given_up[topic] += number
        self._count_gaps(topic)

    def _count_gaps(self, topic: str) -> None:
        """Numbers that are missing and messages that the bus gave up are the same ones, seen twice."""
        lost = max(self._missing[topic], self._given_up[topic])
        if lost > self.gaps[topic]:
            self._say(topic, f"{topic}: {lost - self.gaps[topic]} lost")
            self.gaps[topic] = lost

    def reject(self, topic: str, reason: str) -> None:
        """Count a message that is not believed, and name it, once a second at most for each topic."""
        self.rejected[topic] += 1
        self._say(topic, f"rejected {reason}")

    def _say(self, topic: str, sentence: str) -> None:
        now = time.monotonic()
        if now < self._quiet_until.get(topic, 0.0):
            self._suppressed[topic] += 1
            return
        more = self._suppressed.pop(topic, 0)
        log.warning("%s%s", sentence[:500], f" (and {more} more since)" if more else "")
        self._quiet_until[topic] = now + LOG_INTERVAL_S
