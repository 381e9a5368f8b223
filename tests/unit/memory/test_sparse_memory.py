"""A sparse distributed memory of modular vectors, of a size that tests can wait for."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from benchmarks.memory.recall import corrupted
from benchmarks.memory.speed import NumpyLoop
from cogmap.geometry.arrays import Bytes
from cogmap.services.memory.sparse.config import SparseConfig
from cogmap.services.memory.sparse.interface import iterated_read
from cogmap.services.memory.sparse.modular import (
    COUNTER_LIMIT,
    ModularMemory,
    access_radius,
    hard_addresses,
)
from cogmap.services.memory.sparse.vectors import (
    contains,
    distance,
    distances,
    mean_distance,
    random_vectors,
)

CONFIG = SparseConfig(hard_locations=2000, dimensions=512, seed=3)


def _vectors(count: int) -> Bytes:
    return random_vectors(np.random.default_rng(1), count, CONFIG.dimensions)


def _memory_of(vectors: Bytes, rounds: int = 1) -> ModularMemory:
    memory = ModularMemory(CONFIG)
    for _ in range(rounds):
        for vector in vectors:
            memory.write(vector, vector)
    return memory


def _cue(vector: Bytes, share: float = 0.3) -> Bytes:
    return corrupted(vector, share, 16, np.random.default_rng(2))


def test_an_empty_memory_recalls_nothing() -> None:
    (cue,) = _vectors(1)

    assert ModularMemory(CONFIG).read(cue) is None


def test_a_cue_activates_the_share_of_locations_that_is_configured() -> None:
    radius = access_radius(CONFIG)
    addresses = hard_addresses(CONFIG)

    shares = [np.mean(distances(addresses, cue) <= radius) for cue in _vectors(50)]

    assert np.mean(shares) == pytest.approx(0.07, rel=0.1)


def test_vectors_are_recalled_to_the_last_dimension_from_cues_corrupted_in_three_of_ten() -> None:
    vectors = _vectors(60)
    memory = _memory_of(vectors, rounds=3)

    for vector in vectors[::6]:
        recall = memory.read(_cue(vector))
        assert recall is not None
        assert recall.converged
        assert np.array_equal(recall.vector, vector)


def test_an_iterated_read_comes_nearer_than_a_single_one() -> None:
    vectors = _vectors(100)
    memory = _memory_of(vectors)
    cue = _cue(vectors[0])

    once = memory.read_once(cue)
    recall = memory.read(cue)

    assert once is not None
    assert recall is not None
    assert distance(recall.vector, vectors[0]) < distance(once, vectors[0])


def test_an_iterated_read_ends_after_the_reads_that_are_allowed() -> None:
    vectors = _vectors(100)
    memory = _memory_of(vectors)

    recall = iterated_read(memory.read_once, _cue(vectors[0]), max_reads=2)

    assert recall is not None
    assert (recall.converged, recall.reads) == (False, 2)


def test_what_is_read_for_an_unknown_cue_is_not_related_to_it() -> None:
    *known, unknown = _vectors(101)

    recall = _memory_of(np.stack(known)).read(unknown)

    assert recall is not None
    assert not contains(recall.vector, unknown)


def test_a_vector_that_is_written_a_hundred_times_does_not_drown_the_others() -> None:
    vectors = _vectors(30)
    memory = _memory_of(vectors)
    for _ in range(100):
        memory.write(vectors[0], vectors[0])

    recall = memory.read(_cue(vectors[1]))

    assert recall is not None
    assert distance(recall.vector, vectors[1]) < 0.02 * mean_distance(CONFIG.dimensions)


def test_what_is_written_at_the_same_address_replaces_what_was() -> None:
    address, before, after = _vectors(3)
    memory = ModularMemory(CONFIG)
    memory.write(address, before)
    memory.write(address, after)

    found = memory.read_once(address)

    assert found is not None
    assert distance(found, after) < 0.01 * distance(found, before)


def test_a_sequence_is_followed_from_each_vector_to_the_next() -> None:
    vectors = _vectors(20)
    memory = ModularMemory(CONFIG)
    for vector, following in pairwise(vectors):
        memory.write(vector, following)

    found: Bytes | None = vectors[0]
    for expected in vectors[1:]:
        assert found is not None
        found = memory.read_once(found)
        assert found is not None
        assert distances(vectors, found).argmin() == distances(vectors, expected).argmin()


def test_counters_stop_at_their_limit() -> None:
    (vector,) = _vectors(1)
    memory = ModularMemory(CONFIG)
    memory.counters[:] = COUNTER_LIMIT
    memory.write(vector, vector)

    assert memory.counters.max() == COUNTER_LIMIT
    assert memory.counters.min() >= -COUNTER_LIMIT


def test_the_same_writes_make_the_same_memory() -> None:
    vectors = _vectors(10)

    assert np.array_equal(_memory_of(vectors).counters, _memory_of(vectors).counters)


def test_a_read_is_that_of_a_loop_over_the_hard_locations() -> None:
    vectors = _vectors(40)
    memory = _memory_of(vectors[:20])
    loop = NumpyLoop(CONFIG, memory)

    for cue in vectors:
        found = memory.read_once(cue)
        assert found is not None
        assert np.array_equal(found, loop.read_once(cue))
