"""Sparse distributed memory of bits, with the parameters of LIDA's published framework."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Bytes
from cogmap.services.memory.sparse.codes import bit_codes, hamming
from cogmap.services.memory.sparse.config import SparseConfig
from cogmap.services.memory.sparse.interface import Recall, iterated_read
from cogmap.services.memory.sparse.vectors import random_vectors

# Of LIDA's published framework.
DIMENSIONS = 1000
VALUES = 2
ACCESS_RADIUS = 451
COUNTER_LIMIT = 40


class BinaryMemory:
    """A memory that holds nothing yet: of each hard location's counters one counts up for a 1 and
    down for a 0 that is written, within COUNTER_LIMIT (Kanerva 1988).
    """

    def __init__(self, config: SparseConfig) -> None:
        rng = np.random.default_rng(config.seed)
        addresses = random_vectors(rng, config.hard_locations, DIMENSIONS, VALUES)
        self._codes = bit_codes(addresses)
        self._counters: npt.NDArray[np.int8] = np.zeros(addresses.shape, np.int8)

    @property
    def dimensions(self) -> int:
        """Return 1000."""
        return DIMENSIONS

    @property
    def values(self) -> int:
        """Return 2."""
        return VALUES

    def write(self, address: Bytes, value: Bytes) -> None:
        """Store `value` at `address`, beside what was stored there before."""
        is_active = self._is_active(address)
        steps = np.where(value > 0, 1, -1)

        counted = self._counters[is_active] + steps
        self._counters[is_active] = np.clip(counted, -COUNTER_LIMIT, COUNTER_LIMIT)

    def read_once(self, cue: Bytes) -> Bytes | None:
        """Read the sign of each bit's sum, and the cue's bit where the sum is zero; None if no
        location within reach holds anything.
        """
        held = self._counters[self._is_active(cue)]
        if not held.any():
            return None

        sums = held.sum(axis=0, dtype=np.int64)
        return np.where(sums == 0, cue, sums > 0).astype(np.uint8)

    def read(self, cue: Bytes) -> Recall | None:
        """Read with what was read, until that does not change; None if a read finds nothing."""
        return iterated_read(self.read_once, cue)

    def _is_active(self, cue: Bytes) -> Booleans:
        (code,) = bit_codes(cue[None])
        return hamming(self._codes, code) <= ACCESS_RADIUS
