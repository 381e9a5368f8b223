"""The algebra of the modular composite representation."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.geometry.arrays import Bytes
from cogmap.services.memory.sparse.vectors import (
    bind,
    bundle,
    contained_below,
    contains,
    distance,
    distances,
    mean_distance,
    permuted,
    random_vectors,
    sd_distance,
    unbind,
)

DIMENSIONS = 1024


def _vectors(count: int, values: int = 16) -> Bytes:
    return random_vectors(np.random.default_rng(1), count, DIMENSIONS, values)


def _row(*values: int) -> Bytes:
    return np.array(values, np.uint8)


def test_a_distance_goes_the_shorter_way_around_in_every_dimension() -> None:
    assert distance(_row(0, 1, 15, 4), _row(8, 15, 0, 4)) == 8 + 2 + 1 + 0


def test_distances_of_rows_are_those_of_each() -> None:
    rows = _vectors(5)

    found = distances(rows, rows[3]).tolist()

    assert found == [distance(row, rows[3]) for row in rows]


@pytest.mark.parametrize(
    ("values", "mean", "sd"), [(16, 4096.0, 75.05), (2, 512.0, 16.0)], ids=["modular", "binary"]
)
def test_unrelated_vectors_are_as_far_apart_as_theory_says(
    values: int, mean: float, sd: float
) -> None:
    first, *others = _vectors(2000, values)
    apart = distances(np.stack(others), first, values)

    assert mean_distance(DIMENSIONS, values) == mean
    assert sd_distance(DIMENSIONS, values) == pytest.approx(sd, abs=0.01)
    assert apart.mean() == pytest.approx(mean, abs=0.1 * sd)
    assert apart.std() == pytest.approx(sd, rel=0.05)


@pytest.mark.parametrize("values", [16, 2])
def test_what_was_bound_is_unbound_and_binding_is_related_to_neither(values: int) -> None:
    one, other = _vectors(2, values)
    bound = bind(one, other, values)

    assert np.array_equal(unbind(bound, one, values), other)
    assert not contains(bound, one, values)
    assert not contains(bound, other, values)


def test_binding_keeps_distances() -> None:
    one, other, key = _vectors(3)

    assert distance(bind(one, key), bind(other, key)) == distance(one, other)


@pytest.mark.parametrize(("values", "count"), [(16, 20), (2, 7)], ids=["modular", "binary"])
def test_a_bundle_contains_its_parts_and_nothing_else(values: int, count: int) -> None:
    vectors = _vectors(40, values)
    found = bundle(vectors[:count], values)

    assert all(contains(found, part, values) for part in vectors[:count])
    assert not any(contains(found, other, values) for other in vectors[count:])


def test_a_bundle_of_one_vector_is_that_vector() -> None:
    vectors = _vectors(1)

    assert np.array_equal(bundle(vectors), vectors[0])


def test_a_bundle_is_the_phase_nearest_to_the_sum_the_later_of_two_equally_near() -> None:
    rows = np.stack([_row(0, 15, 3, 14), _row(1, 0, 3, 1), _row(0, 0, 4, 14), _row(1, 15, 4, 1)])

    assert bundle(rows).tolist() == [1, 0, 4, 0]


def test_where_phases_cancel_out_the_first_vector_counts() -> None:
    one = _row(3, 0, 9)
    opposite = _row(11, 8, 1)

    assert bundle(np.stack([one, opposite])).tolist() == [3, 0, 9]
    assert bundle(np.stack([opposite, one])).tolist() == [11, 8, 1]


def test_a_permuted_vector_is_unrelated_until_it_is_permuted_back() -> None:
    (vector,) = _vectors(1)

    assert not contains(permuted(vector, 3), vector)
    assert np.array_equal(permuted(permuted(vector, 3), -3), vector)


def test_containment_begins_five_standard_deviations_below_the_mean() -> None:
    assert contained_below(DIMENSIONS) == pytest.approx(4096 - 5 * 75.05, abs=0.1)
