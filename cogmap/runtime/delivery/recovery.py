"""Fetches the messages that the bus could not deliver from those who published them."""

from __future__ import annotations

import logging
from collections.abc import Iterator

from cogmap.bus.interface import Arrival, Bus
from cogmap.errors import NoAnswerError
from cogmap.runtime.delivery.intake import Intake, number_of
from cogmap.schemas.topics import Topic

log = logging.getLogger("cogmap")
# How long a piece may take. If a slow link carries only a part of it meanwhile, the rest is asked
# for again.
TIMEOUT_S = 3.0
# How often to ask a source that does not answer in time.
TRIES = 4


class Recovery:
    """Fetches what `intake` is missing over `bus`."""

    def __init__(self, bus: Bus, intake: Intake) -> None:
        self._bus = bus
        self._intake = intake

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
        self, topic: Topic, source: str, first: int, last: int, timeout_s: float = TIMEOUT_S
    ) -> Iterator[Arrival]:
        """Yield the messages of `source` with numbers from `first` to `last`, piece by piece; each
        may take `timeout_s`.
        """
        while first <= last:
            asked = first
            for arrival in self._piece(topic, source, first, last, timeout_s):
                number = number_of(arrival.envelope)
                if number is None or not first <= number <= last:
                    continue
                first = number + 1
                yield arrival
            if first == asked:
                return

    def _piece(
        self, topic: Topic, source: str, first: int, last: int, timeout_s: float
    ) -> list[Arrival]:
        """Ask for the messages, again if no answer comes; return none if none comes at all."""
        for _ in range(TRIES):
            try:
                return self._bus.fetch_past(topic, source, first, last, timeout_s)
            except NoAnswerError as error:
                log.debug("%s", error)
        return []
