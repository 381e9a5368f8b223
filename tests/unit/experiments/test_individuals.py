"""Towns of buildings that nobody was taught, and of equal houses."""

from __future__ import annotations

from collections import Counter

import pytest

from cogmap.experiments.individuals.places import (
    BETWEEN,
    equal_houses,
    never_taught,
)
from cogmap.services.sim.layout.blocks import town as blocks
from cogmap.services.sim.layout.blocks.strangers import GATES, GATES_WIDTH_M
from cogmap.services.sim.layout.catalogue import CATALOGUE

TAUGHT = {kind.name for kind in CATALOGUE}


@pytest.mark.parametrize("seed", [1, 2])
def test_in_the_place_of_each_taught_building_stands_a_strange_one_of_its_size(seed: int) -> None:
    usual = blocks.generate(seed)
    strange = never_taught(seed)

    assert TAUGHT & {plot.kind.name for plot in usual.plots}
    names = [plot.kind.name for plot in strange.plots]
    assert not TAUGHT & set(names)
    assert len(set(names)) == len(names)
    assert [plot.footprint for plot in strange.plots] == [plot.footprint for plot in usual.plots]


@pytest.mark.parametrize("seed", [1, 2])
def test_gates_have_room(seed: int) -> None:
    kinds = [plot.kind for plot in never_taught(seed).plots]

    invented = [kind for kind in kinds if kind.name.startswith("invented")]
    assert all(kind.width_m >= GATES_WIDTH_M for kind in invented if kind.pattern == GATES)


def test_equal_houses_have_two_looks_one_of_them_usual_in_a_district() -> None:
    place = equal_houses(1)
    names = [plot.kind.name for plot in place.plots]
    looks = {name.partition(BETWEEN)[0] for name in names}

    assert looks == {"house", "works"}
    assert len(set(names)) == len(names)
    for district in {plot.district for plot in place.plots}:
        inside = [plot for plot in place.plots if plot.district == district]
        count = Counter(plot.kind.name.partition(BETWEEN)[0] for plot in inside)
        ((_, usual),) = count.most_common(1)
        assert usual > 0.6 * len(inside)
