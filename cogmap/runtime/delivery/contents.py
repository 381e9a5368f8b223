"""Which messages of a source have one number, and are not the same."""

from __future__ import annotations

from cogmap.bus.codec import Envelope

REMEMBERED = 1024
"""Numbers of which the contents are known: as many as a publisher's cache holds."""
MAX_UNLIKE = 4
"""Contents that are known of one number beside the first: the last ones."""

WORD_BITS = 65
"""Of what a message can hold as a whole number, with its sign."""


class Contents:
    """What the last messages of a source held, by incarnation and number.

    A number hides no other message: of two that have the same one, and hold different things,
    nobody can tell which is the source's, so both count.
    """

    def __init__(self) -> None:
        self.contradictions = 0
        # Of contents the hash alone: a recorder knows some ten thousand numbers, and goes on
        # filling for hours where a source says little.
        self._known: dict[int, int] = {}
        self._unlike: dict[int, list[int]] = {}

    def contradicts(self, envelope: Envelope, payload: bytes) -> bool:
        """Decide whether another message with that number has come, and count it."""
        number = _number(envelope)
        content = hash(payload)
        first = self._known.get(number, content)
        if content == first or content in self._unlike.get(number, ()):
            return False

        self.contradictions += 1
        return True

    def add(self, envelope: Envelope, payload: bytes) -> None:
        """Take note of a message that counts."""
        number = _number(envelope)
        content = hash(payload)
        if self._known.setdefault(number, content) != content:
            unlike = self._unlike.setdefault(number, [])
            unlike.append(content)
            del unlike[:-MAX_UNLIKE]

        if len(self._known) > REMEMBERED:
            oldest = next(iter(self._known))
            del self._known[oldest]
            self._unlike.pop(oldest, None)


def _number(envelope: Envelope) -> int:
    """Return one number for both, which takes a third of a pair's room. Not a hash, which numbers
    that lie 2^61 apart share.
    """
    return (envelope.incarnation << WORD_BITS) + envelope.seq
