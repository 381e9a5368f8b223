"""The speed of reading sparse distributed memory, over that of a loop over its hard locations."""

from __future__ import annotations

import numpy as np

from benchmarks.timing import least_cpu_s
from cogmap.geometry.arrays import Bytes
from cogmap.services.memory.public import ModularMemory, SparseConfig, hard_addresses, vectors

MASK = np.uint8(vectors.VALUES - 1)
WRITTEN = 50
LOOP_READS = 10
MEMORY_READS = 100


class NumpyLoop:
    """The read of a memory one hard location after the other, on vectors a byte a dimension."""

    def __init__(self, config: SparseConfig, memory: ModularMemory) -> None:
        self._addresses = hard_addresses(config)
        self._counters = memory.counters
        self._mean = memory.counters.mean(axis=0)
        self._radius = memory.radius

    def read_once(self, cue: Bytes) -> Bytes:
        """Read as `ModularMemory.read_once` does."""
        sums = np.zeros_like(self._mean)
        weights = 0

        for address, counters in zip(self._addresses, self._counters, strict=True):
            forwards = (address - cue) & MASK
            backwards = (cue - address) & MASK
            distance = int(np.minimum(forwards, backwards).sum())
            if distance <= self._radius:
                weight = self._radius + 1 - distance
                sums += weight * counters.astype(np.float64)
                weights += weight

        return vectors.nearest_phases(sums - weights * self._mean, cue)


def reads_vs_numpy_loop(seed: int) -> float:
    """Return single reads a second of a memory with the default settings, over those of the loop.

    Both are the least CPU time of several reads.
    """
    config = SparseConfig(seed=seed)
    memory = ModularMemory(config)
    rng = np.random.default_rng([seed, 0])
    for vector in vectors.random_vectors(rng, WRITTEN, config.dimensions):
        memory.write(vector, vector)

    (cue,) = vectors.random_vectors(rng, 1, config.dimensions)
    loop = NumpyLoop(config, memory)
    loop_s = least_cpu_s(lambda: loop.read_once(cue), LOOP_READS)
    memory_s = least_cpu_s(lambda: memory.read_once(cue), MEMORY_READS)
    return loop_s / memory_s
