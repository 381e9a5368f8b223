"""Fetches the messages that the bus could not deliver from those who published them."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator

from cogmap.bus.interface import Arrival, Bus
from cogmap.errors import NoAnswerError
from cogmap.runtime.delivery.intake import Intake, number_of
from cogmap.schemas.topics import Topic

log = logging.getLogger("cogmap")
# How long a piece may take. If a slow link carries only a part of it meanwhile, the rest is asked
# for again.
TIMEOUT_S = 3.0
# How often to ask a source that does not answer, and how long to wait in between: a router that has
# just come back learns of those who answer a moment after their messages.
TRIES = 5
RETRY_S = 0.4


class Recovery:
    """Fetches what `intake` is missing over `bus`."""

    def __init__(self, bus: Bus, intake: Intake) -> None:
        self._bus = bus
        self._intake = intake
        self._pause = threading.Event()

    def before(self, arrival: Arrival) -> Iterator[Arrival]:
        """Yield the messages that are missing before `arrival`, in order, as far as its source has
        kept them. Each is to be accepted before the next is asked for.
        """
        envelope = arrival.envelope
        if envelope is None:
            return
        missing = self._intake.missing_before(arrival.topic, envelope)
        if missing:
            yield from self.fetch(arrival.topic, envelope.source, missing.start, missing.stop - 1)

    def fetch(
        self,
        topic: Topic,
        source: str,
        first: int,
        last: int,
        *,
        timeout_s: float = TIMEOUT_S,
        tries: int = TRIES,
    ) -> Iterator[Arrival]:
        """Yield the messages of `source` with numbers from `first` to `last`, piece by piece; each
        may take `timeout_s`, and is asked for `tries` times if no answer comes.
        """
        while first <= last:
            asked = first
            answer = self._answer(topic, source, range(first, last + 1), timeout_s, tries)
            for arrival in answer:
                number = number_of(arrival.envelope)
                if number is None or not first <= number <= last:
                    continue
                first = number + 1
                yield arrival
            if first == asked:
                return

    def _answer(
        self, topic: Topic, source: str, numbers: range, timeout_s: float, tries: int
    ) -> list[Arrival]:
        """Ask for the messages with these numbers, again if no answer comes; return none if none
        comes at all.
        """
        for attempt in range(tries):
            if attempt > 0:
                self._pause.wait(RETRY_S)
            try:
                last = numbers.stop - 1
                return self._bus.fetch_past(topic, source, numbers.start, last, timeout_s)
            except NoAnswerError as error:
                log.debug("%s", error)
        return []
