"""LIDA's sparse distributed memory of bits."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.memory.recall import corrupted
from cogmap.geometry.arrays import Bytes
from cogmap.services.memory.sparse import binary
from cogmap.services.memory.sparse.build import build
from cogmap.services.memory.sparse.config import SparseConfig
from cogmap.services.memory.sparse.interface import MAX_READS, AssociativeMemory
from cogmap.services.memory.sparse.modular import ModularMemory
from cogmap.services.memory.sparse.vectors import distance, random_vectors


def _vectors(count: int) -> Bytes:
    return random_vectors(np.random.default_rng(1), count, binary.DIMENSIONS, binary.VALUES)


@pytest.fixture(name="memory")
def _memory() -> AssociativeMemory:
    return build(SparseConfig(kind="binary"))


def test_the_parameters_are_lidas() -> None:
    config = SparseConfig()
    parameters = (binary.DIMENSIONS, binary.ACCESS_RADIUS, binary.COUNTER_LIMIT)

    assert (config.hard_locations, MAX_READS) == (10_000, 19)
    assert parameters == (1000, 451, 40)


def test_the_kind_of_memory_is_the_one_that_is_configured(memory: AssociativeMemory) -> None:
    modular = build(SparseConfig(hard_locations=1000))

    assert isinstance(modular, ModularMemory)
    assert (modular.dimensions, modular.values) == (1024, 16)
    assert (memory.dimensions, memory.values) == (1000, 2)


def test_an_empty_memory_recalls_nothing(memory: AssociativeMemory) -> None:
    (cue,) = _vectors(1)

    assert memory.read(cue) is None


def test_nothing_is_recalled_where_nothing_is_within_reach(memory: AssociativeMemory) -> None:
    (vector,) = _vectors(1)
    memory.write(vector, vector)

    assert memory.read(1 - vector) is None


def test_most_vectors_are_recalled_from_cues_corrupted_in_one_of_ten(
    memory: AssociativeMemory,
) -> None:
    """Some ten hard locations are within reach of an address, and of its cue now and then none."""
    vectors = _vectors(30)
    for vector in vectors:
        memory.write(vector, vector)

    right = 0
    for number, vector in enumerate(vectors):
        cue = corrupted(vector, 0.1, binary.VALUES, np.random.default_rng(number))
        recall = memory.read(cue)
        right += recall is not None and distance(recall.vector, vector, binary.VALUES) < 50

    assert right >= 27


def test_a_value_is_read_at_the_address_of_another(memory: AssociativeMemory) -> None:
    address, value = _vectors(2)
    memory.write(address, value)

    found = memory.read_once(address)

    assert found is not None
    assert np.array_equal(found, value)


def test_counters_stop_at_forty(memory: AssociativeMemory) -> None:
    address, value = _vectors(2)
    for _ in range(100):
        memory.write(address, value)
    for _ in range(binary.COUNTER_LIMIT + 1):
        memory.write(address, 1 - value)

    found = memory.read_once(address)

    assert found is not None
    assert np.array_equal(found, 1 - value)
