"""Records, sequences and trees as vectors, and what is read back from them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.memory.recall import corrupted
from cogmap.geometry.arrays import Bytes
from services.memory.sparse.config import SparseConfig
from services.memory.sparse.memory import SparseMemory
from services.memory.sparse.structures import (
    ItemMemory,
    decode_filler,
    decode_sequence,
    encode_record,
    encode_sequence,
)
from services.memory.sparse.trees import Tree, read_tree, write_tree
from services.memory.sparse.vectors import contains, random_vectors

KINDS = [(1024, 16), (1000, 2)]
PLACES = {f"place {number}": f"building {number % 5}" for number in range(8)}
TOWN = Tree(
    "town",
    (
        Tree("north", (Tree("church"), Tree("school", (Tree("gym"), Tree("hall"))))),
        Tree("south", (Tree("station"), Tree("mill"), Tree("church"))),
        Tree("river"),
    ),
)


@pytest.fixture(name="items", params=KINDS, ids=["modular", "binary"])
def _items(request: pytest.FixtureRequest) -> ItemMemory:
    dimensions, values = request.param
    return ItemMemory(1, dimensions, values)


def _unrelated(items: ItemMemory) -> Bytes:
    rng = np.random.default_rng(9)
    (vector,) = random_vectors(rng, 1, items.dimensions, items.values)
    return vector


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


def test_a_noisy_item_is_cleaned_up_and_noise_is_no_item(items: ItemMemory) -> None:
    assert items.clean_up(_unrelated(items)) is None

    for number in range(100):
        items.item(f"building {number}")
    noise = np.random.default_rng(2)
    noisy = corrupted(items.item("building 7"), 0.6, items.values, noise)

    assert items.clean_up(noisy) == "building 7"
    assert items.clean_up(_unrelated(items)) is None


def test_every_filler_of_a_record_is_read_back_by_its_role(items: ItemMemory) -> None:
    record = encode_record(items, PLACES)

    found = {role: decode_filler(items, record, role) for role in PLACES}

    assert found == PLACES
    assert decode_filler(items, record, "place 8") is None


def test_a_record_is_the_same_in_whatever_order_it_is_given(items: ItemMemory) -> None:
    backwards = dict(reversed(PLACES.items()))

    assert np.array_equal(encode_record(items, PLACES), encode_record(items, backwards))


def test_records_that_differ_in_all_fillers_are_unrelated(items: ItemMemory) -> None:
    others = dict.fromkeys(PLACES, "mill")

    one = encode_record(items, PLACES)
    other = encode_record(items, others)

    assert not contains(one, other, items.values)


def test_a_sequence_is_read_back_in_order_with_repetitions(items: ItemMemory) -> None:
    names = ["church", "school", "church", "mill", "mill", "station"]

    assert decode_sequence(items, encode_sequence(items, names)) == names


def test_a_tree_is_read_back_from_memory_whatever_its_depth() -> None:
    memory = SparseMemory(SparseConfig())
    items = ItemMemory(1, memory.dimensions)
    vector = write_tree(memory, items, TOWN)

    assert read_tree(memory, items, vector) == TOWN


def test_a_tree_is_read_back_from_a_corrupted_cue_among_other_trees() -> None:
    memory = SparseMemory(SparseConfig())
    items = ItemMemory(1, memory.dimensions)
    for number in range(20):
        leaves = tuple(Tree(f"building {number} {leaf}") for leaf in range(3))
        write_tree(memory, items, Tree(f"town {number}", leaves))

    vector = write_tree(memory, items, TOWN)
    cue = corrupted(vector, 0.3, items.values, np.random.default_rng(3))

    assert read_tree(memory, items, cue) == TOWN


def test_what_was_never_stored_is_no_tree() -> None:
    memory = SparseMemory(SparseConfig(hard_locations=1000))
    items = ItemMemory(1, memory.dimensions)

    assert read_tree(memory, items, _unrelated(items)) is None

    write_tree(memory, items, TOWN)

    assert read_tree(memory, items, _unrelated(items)) is None
