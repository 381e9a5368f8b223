"""The towns that map structure is measured on."""

from __future__ import annotations

import numpy as np

from benchmarks.map_structure.measure import sub_maps_of
from benchmarks.map_structure.towns import FUNCTIONS, MIN_OBJECTS, UNKNOWN, town
from cogmap.services.codelets.sub_maps.config import Config


def test_a_seed_always_gives_the_same_town() -> None:
    first = town(3)
    second = town(3)

    assert first.positions_m.tolist() == second.positions_m.tolist()
    assert first.functions.tolist() == second.functions.tolist()
    assert first.boundaries_m.tolist() == second.boundaries_m.tolist()
    assert first.districts.tolist() == second.districts.tolist()


def test_every_district_has_objects_of_several_functions() -> None:
    made = town(4)

    for district in np.unique(made.districts):
        functions = made.functions[made.districts == district]
        assert len(functions) >= MIN_OBJECTS
        assert len(np.unique(functions[functions != UNKNOWN])) > 1


def test_a_function_is_found_in_several_districts() -> None:
    made = town(4)

    districts_with = [made.districts[made.functions == function] for function in range(FUNCTIONS)]

    assert all(len(np.unique(districts)) > 1 for districts in districts_with)


def test_objects_are_selected_with_all_that_is_known_of_them() -> None:
    made = town(5)

    few = made.select(np.array([8, 2]))

    assert few.positions_m.tolist() == [made.positions_m[8].tolist(), made.positions_m[2].tolist()]
    assert few.districts.tolist() == [made.districts[8], made.districts[2]]


def test_sub_maps_know_a_town_but_not_its_districts() -> None:
    made = town(5, districts=3)
    elsewhere = made.select(np.arange(len(made.positions_m)))
    elsewhere.districts[:] = 0

    found = sub_maps_of(made, Config())
    found.settle()
    same = sub_maps_of(elsewhere, Config())
    same.settle()

    assert found.labels.tolist() == same.labels.tolist()
