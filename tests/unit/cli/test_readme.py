"""The commands of README.md, where they name something of a town."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cogmap.services.sim.config import Config
from cogmap.services.sim.layout import towns

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("page", ["README.md", "docs/towns.md"])
def test_a_street_that_is_closed_is_one_of_the_town_of_blocks(page: str) -> None:
    written = re.findall(r'street (?:close|=) "(.+?)"', (ROOT / page).read_text("utf-8"))
    town = towns.place(towns.BLOCKS, Config().seed, Config().town_size_m)

    assert written
    assert set(written) <= {road.name for road in town.roads}


def test_a_goal_by_name_is_a_building_of_the_town_of_blocks() -> None:
    written = re.findall(r"cogmap goal ([a-z]+)", (ROOT / "README.md").read_text("utf-8"))
    town = towns.place(towns.BLOCKS, Config().seed, Config().town_size_m)

    assert written
    assert set(written) <= {plot.kind.name for plot in town.plots}
