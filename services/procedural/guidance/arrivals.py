"""Whether the agent comes to the places that guidance schemes lead to. Pure."""

from __future__ import annotations

from typing import NamedTuple

# Twice the time that 40 m (AHEAD_M) take at cruising speed; and how near to its end counts.
WITHIN_NS = 20_000_000_000
THERE_M = 2.0


class Arrival(NamedTuple):
    """A place, by path integration in metres, and until when the agent is awaited there."""

    place_m: complex
    until_ns: int


class Arrivals:
    """Judges each execution of a scheme: it is a success where the agent comes within THERE_M of
    the end of its path in WITHIN_NS, whatever other schemes bring it there.

    A scheme that is executed again before it is judged is awaited at its newer place.
    """

    def __init__(self) -> None:
        self._awaited: dict[str, Arrival] = {}

    def expect(self, scheme: str, place_m: complex, stamp_ns: int) -> None:
        """Await the agent at the place to which an executed scheme leads."""
        self._awaited[scheme] = Arrival(place_m, stamp_ns + WITHIN_NS)

    def judged(self, at_m: complex, stamp_ns: int) -> dict[str, bool]:
        """Judge schemes by where the agent is at a time; return which, and whether with success."""
        judged = {}
        for scheme, arrival in self._awaited.items():
            is_there = abs(arrival.place_m - at_m) <= THERE_M
            if is_there or stamp_ns > arrival.until_ns:
                judged[scheme] = is_there

        for scheme in judged:
            del self._awaited[scheme]
        return judged
