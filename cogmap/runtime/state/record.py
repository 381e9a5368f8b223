"""What the database keeps, and the digests by which damage to it is noticed."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import blake2b
from typing import NamedTuple

# So many that no two records have one digest by chance.
DIGEST_BYTES = 16
_LENGTH_BYTES = 8


class Record(NamedTuple):
    """A payload under its key, which no other record has. `kind` says what the payload is."""

    key: str
    kind: str
    payload: bytes


def digest_of(record: Record, sequence: int) -> bytes:
    """Return BLAKE2b of key, sequence number, kind and payload, each with its length before it.

    It has DIGEST_BYTES bytes. Raises UnicodeEncodeError if key or kind is no text.
    """
    key = record.key.encode()
    kind = record.kind.encode()
    number = sequence.to_bytes(_LENGTH_BYTES, "little", signed=True)

    hasher = blake2b(digest_size=DIGEST_BYTES)
    for part in (key, number, kind, record.payload):
        length = len(part).to_bytes(_LENGTH_BYTES, "little")
        hasher.update(length)
        hasher.update(part)

    return hasher.digest()


@dataclass(frozen=True)
class Totals:
    """How many records there are, and the exclusive or of their digests, in any order."""

    count: int = 0
    combined: bytes = bytes(DIGEST_BYTES)

    def plus(self, digest: bytes) -> Totals:
        """Return the totals with one more record."""
        return Totals(self.count + 1, self._combined_with(digest))

    def minus(self, digest: bytes) -> Totals:
        """Return the totals without a record that is among them."""
        return Totals(self.count - 1, self._combined_with(digest))

    def _combined_with(self, digest: bytes) -> bytes:
        combined = int.from_bytes(self.combined) ^ int.from_bytes(digest)
        return combined.to_bytes(DIGEST_BYTES)
