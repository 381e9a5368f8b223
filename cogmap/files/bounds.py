"""How much a file may hold and take: what is packed small may be a gigabyte when it is unpacked.

A file's content has at most `most_bytes()`, and what a reader keeps of it takes as much. What is
packed unpacks to at most FACTOR times its size, and to FLOOR_BYTES in any case: XML, tables and
messages that are worth packing shrink to a tenth of their size, a file of one byte repeated to a
thousandth or less. Where $COGMAP_MAX_FILE_MB is set, its size is the only bound.
"""

from __future__ import annotations

import os
from pathlib import Path

from cogmap.errors import BoundError, ConfigError

VARIABLE = "COGMAP_MAX_FILE_MB"
MIB = 1 << 20
DEFAULT_MB = 2048
MOST_MB = 1 << 24
FACTOR = 32
FLOOR_BYTES = 16 * MIB


def most_bytes() -> int:
    """Return how many bytes a file may hold. Raises ConfigError if the variable is no number."""
    given = os.environ.get(VARIABLE, "")
    if not given:
        return DEFAULT_MB * MIB

    is_number = given.isascii() and given.isdecimal() and len(given) < 10
    size_mb = int(given) if is_number else 0
    if not 0 < size_mb <= MOST_MB:
        raise ConfigError(f"${VARIABLE} is {given[:40]!r}: set it to 1 to {MOST_MB}, in MiB")
    return size_mb * MIB


def most_unpacked(packed_bytes: int, floor_bytes: int = FLOOR_BYTES) -> int:
    """Return how many bytes so many packed ones may become. Raises ConfigError."""
    if os.environ.get(VARIABLE):
        return most_bytes()
    return min(most_bytes(), max(floor_bytes, FACTOR * packed_bytes))


class Budget:
    """The bytes that something in the file at `path` may take, `limit` or most_bytes() in all.

    `doing`, such as "unpacks to", is the verb of the sentence for a file that takes more.
    """

    def __init__(self, path: Path | str, doing: str = "takes", limit: int | None = None) -> None:
        self._path = path
        self._doing = doing
        self._limit = most_bytes() if limit is None else limit
        self._left = self._limit

    def take(self, size: int) -> None:
        """Take so many bytes more. Raises BoundError if they are more than there may be."""
        self._left -= size
        self.check(0)

    def check(self, size: int) -> None:
        """Raise BoundError if so many bytes, which are not taken, are more than are left."""
        if size > self._left:
            raise BoundError(
                f"{self._path} {self._doing} more than {shown(self._limit)}, the bound for a file "
                f"of its size: set {VARIABLE} to a number of MiB if you trust it"
            )


def shown(size: int) -> str:
    """Write a number of bytes as people read it."""
    return f"{size / MIB:.0f} MiB" if size >= MIB else f"{size} bytes"
