"""Names, and sequences of them, as vectors."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from cogmap.services.memory.sparse.structures import ItemMemory, encode_sequence
from cogmap.services.memory.sparse.vectors import contains, permuted, unbind

KINDS = [(1024, 16), (1000, 2)]


@pytest.fixture(name="items", params=KINDS, ids=["modular", "binary"])
def _items(request: pytest.FixtureRequest) -> ItemMemory:
    dimensions, values = request.param
    return ItemMemory(1, dimensions, values)


def test_the_vector_of_a_name_depends_on_the_seed_and_the_name_alone() -> None:
    items = ItemMemory(1, 1024)
    items.item("school")

    assert np.array_equal(items.item("church"), ItemMemory(1, 1024).item("church"))
    assert not contains(items.item("church"), ItemMemory(2, 1024).item("church"))
    assert not contains(items.item("church"), items.item("school"))
    assert not contains(items.item("church"), items.role("church"))


def test_the_vector_of_a_name_never_changes() -> None:
    found = ItemMemory(1, 1024).item("church")

    assert found[:6].tolist() == [9, 13, 15, 7, 11, 14]


def test_names_that_are_not_used_again_take_no_memory() -> None:
    items = ItemMemory(1, 1024)
    for number in range(1000):
        items.item(f"goal {number}")

    tracemalloc.start()
    try:
        for number in range(1000, 2000):
            items.item(f"goal {number}")
        grown_bytes, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()

    # What replaces older ones is traced, and at most as much as all that is kept.
    assert grown_bytes < 1000 * 1024


def test_a_name_in_a_role_is_unrelated_to_the_name_and_to_other_roles(items: ItemMemory) -> None:
    filled = items.filled("north", "church")

    assert not contains(filled, items.item("church"), items.values)
    assert not contains(filled, items.filled("south", "church"), items.values)
    assert np.array_equal(unbind(filled, items.role("north"), items.values), items.item("church"))


def test_a_sequence_has_each_item_at_its_place_with_repetitions(items: ItemMemory) -> None:
    names = ["church", "school", "church", "mill", "mill", "station"]
    sequence = encode_sequence(items, names)

    for place, name in enumerate(names):
        for other in {*names, "tower"}:
            is_there = contains(permuted(sequence, -place), items.item(other), items.values)
            assert is_there == (other == name)


def test_sequences_of_the_same_items_in_another_order_are_unrelated(items: ItemMemory) -> None:
    one = encode_sequence(items, ["church", "school", "mill", "station"])
    other = encode_sequence(items, ["school", "church", "station", "mill"])

    assert not contains(one, other, items.values)
