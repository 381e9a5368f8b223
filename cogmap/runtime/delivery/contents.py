"""Which messages of a source have one number, and are not the same."""

from __future__ import annotations

from cogmap.bus.codec import Envelope

REMEMBERED = 1024
"""Numbers of which the contents are known: as many as a publisher's cache holds."""
MAX_UNLIKE = 4
"""Contents that are known of one number: the last ones."""

_Key = tuple[int, int]


class Contents:
    """What the last messages of a source held, by incarnation and number.

    A number hides no other message: of two that have the same one, and hold different things,
    nobody can tell which is the source's, so both count.
    """

    def __init__(self) -> None:
        self.contradictions = 0
        self._known: dict[_Key, list[int]] = {}

    def contradicts(self, envelope: Envelope, payload: bytes) -> bool:
        """Decide whether another message with that number has come, and count it."""
        known = self._known.get(_key(envelope))
        if known is None or hash(payload) in known:
            return False

        self.contradictions += 1
        return True

    def add(self, envelope: Envelope, payload: bytes) -> None:
        """Take note of a message that counts."""
        known = self._known.setdefault(_key(envelope), [])
        known.append(hash(payload))
        del known[:-MAX_UNLIKE]
        if len(self._known) > REMEMBERED:
            del self._known[next(iter(self._known))]


def _key(envelope: Envelope) -> _Key:
    return envelope.incarnation, envelope.seq
