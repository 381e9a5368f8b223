from __future__ import annotations

import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_to
from cogmap.services.memory.associations import Associations
from cogmap.services.memory.sparse.config import SparseConfig

POSE = np.array([30.0, -10.0, 0.7])
TOWNS = 4


def town(seed: int, count: int = 30) -> tuple[list[str], Floats]:
    """Buildings of ten looks at random in a town of 200 m."""
    rng = np.random.default_rng(seed)
    looks = [f"look {number}" for number in rng.integers(0, 10, count).tolist()]
    return looks, rng.uniform(-100, 100, (count, 2))


@pytest.fixture(scope="module")
def known() -> Associations:
    """Towns 1 to TOWNS, learned."""
    associations = Associations(SparseConfig())
    for seed in range(1, 1 + TOWNS):
        associations.learn(f"town {seed}", *town(seed))
    return associations


@pytest.mark.parametrize("seed", [1, 2, TOWNS])
def test_a_part_of_a_town_reminds_of_it_from_a_frame_of_its_own(
    known: Associations, seed: int
) -> None:
    looks, at_m = town(seed)
    is_here = np.hypot(*(at_m - at_m[0]).T) < 70.0
    here = [look for look, inside in zip(looks, is_here.tolist(), strict=True) if inside]

    assert known.reminded_of(here, transform_to(POSE, at_m[is_here]))[0] == f"town {seed}"


def test_the_whole_of_a_town_reminds_of_it_with_nearly_all_objects_a_little_displaced(
    known: Associations,
) -> None:
    looks, at_m = town(2)
    noise_m = np.random.default_rng(9).normal(0.0, 0.3, at_m.shape)

    assert known.reminded_of(looks, at_m + noise_m)[0] == "town 2"


def test_an_empty_memory_is_reminded_of_nothing() -> None:
    assert Associations(SparseConfig(hard_locations=1000)).reminded_of(*town(1)) == []
