"""Which of the vectors that are kept a noisy one is."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.memory.recall import corrupted
from cogmap.geometry.arrays import Bytes
from cogmap.services.memory.sparse.clean_up import CleanUpMemory
from cogmap.services.memory.sparse.vectors import random_vectors

KINDS = [(1024, 16), (1000, 2)]


@pytest.fixture(name="kept", params=KINDS, ids=["modular", "binary"])
def _kept(request: pytest.FixtureRequest) -> tuple[CleanUpMemory[int], Bytes, int]:
    """A memory of a hundred vectors by their numbers, and those with one that is not kept."""
    dimensions, values = request.param
    vectors = random_vectors(np.random.default_rng(9), 101, dimensions, values)
    memory: CleanUpMemory[int] = CleanUpMemory(values)
    for number in range(100):
        memory.put(number, vectors[number])

    return memory, vectors, values


Kept = tuple[CleanUpMemory[int], Bytes, int]


def test_a_noisy_vector_is_cleaned_up_and_noise_is_none(kept: Kept) -> None:
    memory, vectors, values = kept
    noisy = corrupted(vectors[7], 0.6, values, np.random.default_rng(2))

    assert memory.nearest(noisy) == 7
    assert memory.nearest(vectors[100]) is None


def test_what_is_forgotten_or_not_wanted_is_not_found(kept: Kept) -> None:
    memory, vectors, _ = kept
    memory.forget(7)

    assert memory.nearest(vectors[7]) is None
    assert memory.nearest(vectors[8], lambda number: number != 8) is None
    assert 7 not in memory.keys


def test_an_empty_memory_finds_nothing() -> None:
    assert CleanUpMemory[int]().nearest(np.zeros(64, np.uint8)) is None
