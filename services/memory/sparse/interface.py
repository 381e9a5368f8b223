"""What both kinds of sparse distributed memory can do, and their iterated read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cogmap.geometry.arrays import Bytes

MAX_READS = 19
"""Reads after which an iterated read ends, converged or not (LIDA)."""


@dataclass(frozen=True, eq=False)
class Recall:
    """What an iterated read ended with, whether its last read changed nothing, and their number."""

    vector: Bytes
    converged: bool
    reads: int


class AssociativeMemory(Protocol):
    """Vectors of `dimensions` values below `values`, stored at addresses that are vectors too.

    A vector that is stored at itself is completed from a corrupted cue by `read`. One that is
    stored at another is what follows that one, and found there by `read_once`.
    """

    @property
    def dimensions(self) -> int:
        """Return the length of addresses, values and cues."""
        ...

    @property
    def values(self) -> int:
        """Return the number of values that a dimension has."""
        ...

    def write(self, address: Bytes, value: Bytes) -> None:
        """Store `value` at `address`."""
        ...

    def read_once(self, cue: Bytes) -> Bytes | None:
        """Read what is stored around `cue`; None if nothing is within its reach."""
        ...

    def read(self, cue: Bytes) -> Recall | None:
        """Read with what was read, until that does not change; None if a read finds nothing.

        Some vector is read for a cue that was never stored, too. It is then seldom converged on in
        a memory that holds much, and not related to the cue (`vectors.contains`).
        """
        ...


def iterated_read(
    read_once: Callable[[Bytes], Bytes | None], cue: Bytes, max_reads: int = MAX_READS
) -> Recall | None:
    """Read at `cue`, then at what was read (Kanerva 1988), up to `max_reads` times."""
    vector = cue
    for reads in range(1, max_reads + 1):
        found = read_once(vector)
        if found is None:
            return None
        if np.array_equal(found, vector):
            return Recall(found, True, reads)
        vector = found

    return Recall(vector, False, max_reads)
