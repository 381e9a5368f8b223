"""The Hamming distance of codes is the distance of the vectors."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.services.memory.sparse.codes import bit_codes, hamming, johnson_codes
from cogmap.services.memory.sparse.vectors import distance, distances, random_vectors


def test_the_codes_of_any_two_values_differ_by_their_distance_around_the_circle() -> None:
    values = np.arange(16, dtype=np.uint8)[:, None]
    codes = johnson_codes(values)

    for row, value in enumerate(values):
        expected = [distance(other, value) for other in values]
        assert hamming(codes, codes[row]).tolist() == expected


@pytest.mark.parametrize("dimensions", [8, 1024, 1021])
def test_the_hamming_distance_of_codes_is_that_of_modular_vectors(dimensions: int) -> None:
    vectors = random_vectors(np.random.default_rng(1), 50, dimensions)
    codes = johnson_codes(vectors)

    found = hamming(codes, codes[7]).tolist()

    assert found == distances(vectors, vectors[7]).tolist()


def test_the_hamming_distance_of_bit_codes_is_that_of_binary_vectors() -> None:
    vectors = random_vectors(np.random.default_rng(2), 50, 1000, values=2)
    codes = bit_codes(vectors)

    found = hamming(codes, codes[-1]).tolist()

    assert found == distances(vectors, vectors[-1], values=2).tolist()


def test_a_location_of_1024_dimensions_takes_a_kilobyte() -> None:
    vectors = random_vectors(np.random.default_rng(3), 10, 1024)

    assert johnson_codes(vectors).nbytes == 10 * 1024
