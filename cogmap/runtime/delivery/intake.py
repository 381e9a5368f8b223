"""Checks what arrives: received, or counted and named."""

from __future__ import annotations

import logging
import time
from collections import Counter

from cogmap.bus.codec import UNKNOWN, Envelope, decode
from cogmap.bus.interface import Arrival
from cogmap.errors import MessageError
from cogmap.runtime.delivery.contents import Contents
from cogmap.runtime.delivery.numbers import MAX_JUMP, Newest, Numbers
from cogmap.runtime.delivery.plausibility import Plausibility
from cogmap.schemas.base import Message
from cogmap.schemas.topics import Delivery, Topic

log = logging.getLogger("cogmap")
LOG_INTERVAL_S = 1.0
_MAX_SENTENCE = 500
MAX_SOURCES = 1024
MAX_INCARNATIONS = 4
"""Lives of a source whose numbers are kept: one that was away may come back."""


def number_of(envelope: Envelope | None) -> int | None:
    """Return a message's number among all of its source on its topic, of every incarnation; None if
    the source does not count them.
    """
    if envelope is None or envelope.earlier == UNKNOWN:
        return None
    return envelope.earlier + envelope.seq


class _Stream:
    """What has come of one source on one topic, from one incarnation to the next."""

    def __init__(self, first: Envelope) -> None:
        self._last = first
        self._numbers = {first.incarnation: Numbers(first.seq)}
        self._contents = Contents()

    @property
    def number(self) -> int | None:
        """Return the greatest number among all that the source published; None if it does not count
        them.
        """
        last = self._last
        if last.earlier == UNKNOWN:
            return None
        return last.earlier + self._numbers[last.incarnation].last

    def before(self, envelope: Envelope) -> range:
        """Return the numbers between the greatest and that of `envelope`: none if they are unknown,
        or too many to be believed.
        """
        is_earlier = envelope.incarnation in self._numbers
        is_present = envelope.incarnation == self._last.incarnation
        greatest = self.number
        number = number_of(envelope)
        if greatest is None or number is None or (is_earlier and not is_present):
            return range(0)
        if number - greatest > MAX_JUMP:
            return range(0)
        return range(greatest + 1, number)

    @property
    def contradictions(self) -> int:
        """Return how many messages had the number of another one."""
        return self._contents.contradictions

    def begin(self, payload: bytes) -> None:
        """Take note of what the first message holds."""
        self._contents.add(self._last, payload)

    def advance(self, envelope: Envelope, payload: bytes) -> int:
        """Take account of a message. Returns how many more are missing because of it.

        Raises MessageError if it came before, or its number cannot be believed yet.
        """
        numbers = self._numbers.get(envelope.incarnation)
        missing = 0
        if numbers is None:
            missing = self._begin(envelope)
        elif not self._contents.contradicts(envelope, payload):
            missing = numbers.add(envelope.seq)

        self._contents.add(envelope, payload)
        self._last = envelope
        return missing

    def resume(self, envelope: Envelope) -> None:
        """Go on from `envelope`, which was received before this process was started."""
        self._numbers[envelope.incarnation] = Numbers(envelope.seq)
        self._forget_oldest()
        self._last = envelope

    def _begin(self, envelope: Envelope) -> int:
        """Begin an incarnation. Returns how many messages of those before never came."""
        missing = self.before(envelope)
        self._numbers[envelope.incarnation] = Numbers(envelope.seq)
        self._forget_oldest()
        return max(0, missing.stop - missing.start)

    def _forget_oldest(self) -> None:
        if len(self._numbers) > MAX_INCARNATIONS:
            del self._numbers[next(iter(self._numbers))]


class Intake:
    """Decodes arrivals and counts, by topic, the received, the rejected and the lost (`gaps`).

    A source that began after `since_ns` is missing from its number 0 on; without that, nothing is
    missing before the first message that comes. With `plausibility` it refuses what cannot be true.
    Messages of one number that are unlike are all received.
    """

    def __init__(
        self, plausibility: Plausibility | None = None, *, since_ns: int | None = None
    ) -> None:
        self._plausibility = plausibility
        self._since_ns = since_ns
        self.received: Counter[str] = Counter()
        self.rejected: Counter[str] = Counter()
        self.gaps: Counter[str] = Counter()
        self._missing: Counter[str] = Counter()
        self._given_up: Counter[str] = Counter()
        self._contradictions = 0
        self._last_contradiction = ""
        self._streams: dict[tuple[Topic, str], _Stream] = {}
        self._newest: dict[tuple[Topic, str, int], Newest] = {}
        self._log_after_s: dict[str, float] = {}
        self._suppressed: Counter[str] = Counter()

    def accept(self, arrival: Arrival) -> Message | None:
        """Return the message in `arrival`, or None if it is not one or was received before."""
        topic = arrival.topic
        envelope = arrival.envelope
        try:
            if arrival.refused:
                raise MessageError(f"{topic.name}: {arrival.refused}")
            message = decode(topic, arrival.payload)
            if envelope is None:
                raise MessageError(f"{topic.name}: no envelope")
            if (envelope.source, envelope.seq) != (message.source, message.seq):
                raise MessageError(f"{topic.name}: envelope and message name different sources")
            if self._plausibility is not None:
                remark = self._plausibility.check(topic, message, time.monotonic_ns())
                if remark:
                    self._log(topic.name, remark)
            if topic.delivery is Delivery.NEVER_DROP:
                self._follow(topic, envelope, bytes(arrival.payload))
            else:
                self._follow_newest(topic, envelope)
        except MessageError as error:
            self.reject(topic.name, str(error))
            return None

        self.received[topic.name] += 1
        return message

    def missing_before(self, topic: Topic, envelope: Envelope) -> range:
        """Return the numbers of the messages that have not come before that of `envelope`, of all
        that its source published on `topic`; none if it does not count them.
        """
        stream = self._streams.get((topic, envelope.source))
        if stream is not None:
            return stream.before(envelope)
        number = number_of(envelope)
        is_since = self._since_ns is not None and envelope.incarnation > self._since_ns
        return range(0) if number is None or not is_since else range(envelope.earlier, number)

    def resume(self, topic: Topic, envelope: Envelope) -> None:
        """Go on from a message of `topic` that was received before this process was started."""
        stream = self._streams.get((topic, envelope.source))
        if stream is None:
            self._streams[topic, envelope.source] = _Stream(envelope)
        else:
            stream.resume(envelope)

    def received_up_to(self) -> dict[tuple[Topic, str], int]:
        """Return the number of the last message of each source on each topic, among all that it has
        published there; without the sources that do not count them.
        """
        numbers = {key: stream.number for key, stream in self._streams.items()}
        return {key: number for key, number in numbers.items() if number is not None}

    def count_lost(self, topic: str, number: int) -> None:
        """Count messages of `topic` that the bus gave up; called from its threads.

        Not for who fetches them: the numbers show what is lost for good.
        """
        self._given_up[topic] += number
        self._count_gaps(topic)

    def reject(self, topic: str, reason: str) -> None:
        """Count a message that is ignored, and log the reason at most once a second a topic."""
        self.rejected[topic] += 1
        self._log(topic, f"rejected {reason}")

    def notes(self) -> list[str]:
        """Return what cannot be true of the messages, and which contradict each other."""
        notes = [] if self._plausibility is None else self._plausibility.notes()
        if self._contradictions:
            notes.append(
                f"{self._contradictions} messages contradict others of the same number, the last: "
                f"{self._last_contradiction}: somebody else publishes in its name"
            )
        return notes

    def _follow(self, topic: Topic, envelope: Envelope, payload: bytes) -> None:
        """Notice what is missing before a message. Raises MessageError for one that came before,
        or whose number cannot be believed yet.
        """
        stream = self._streams.get((topic, envelope.source))
        if stream is None:
            self._streams[topic, envelope.source] = _Stream(envelope)
            self._streams[topic, envelope.source].begin(payload)
            return

        contradictions = stream.contradictions
        try:
            missing = stream.advance(envelope, payload)
        except MessageError as error:
            raise MessageError(
                f"{topic.name}: number {envelope.seq} of {envelope.source} {error}"
            ) from None
        if stream.contradictions > contradictions:
            self._contradictions += 1
            self._last_contradiction = f"{topic.name}: number {envelope.seq} of {envelope.source}"
            self._log(topic.name, f"{self._last_contradiction} came twice, with unlike contents")
        if missing:
            self._missing[topic.name] += missing
            self._count_gaps(topic.name)

    def _follow_newest(self, topic: Topic, envelope: Envelope) -> None:
        """Compare a message with the one before. Raises MessageError if its number cannot be
        believed yet.
        """
        key = (topic, envelope.source, envelope.incarnation)
        newest = self._newest.get(key)
        if newest is None:
            newest = self._newest[key] = Newest()
            if len(self._newest) > MAX_SOURCES:
                del self._newest[next(iter(self._newest))]

        try:
            newest.add(envelope.seq)
        except MessageError as error:
            raise MessageError(
                f"{topic.name}: number {envelope.seq} of {envelope.source} {error}"
            ) from None

    def _count_gaps(self, topic: str) -> None:
        """Count the lost once: numbers that are missing are also what the bus gave up."""
        missing = self._missing[topic]
        given_up = self._given_up[topic]
        lost = max(missing, given_up)
        new = lost - self.gaps[topic]
        if lost:
            self.gaps[topic] = lost
        else:
            self.gaps.pop(topic, None)
        if new > 0:
            self._log(topic, f"{topic}: {new} lost")

    def _log(self, topic: str, sentence: str) -> None:
        now_s = time.monotonic()
        if now_s < self._log_after_s.get(topic, 0.0):
            self._suppressed[topic] += 1
            return

        suppressed = self._suppressed.pop(topic, 0)
        more = f" (and {suppressed} more since)" if suppressed else ""
        log.warning("%s%s", sentence[:_MAX_SENTENCE], more)
        self._log_after_s[topic] = now_s + LOG_INTERVAL_S
