"""Towns of buildings that nobody was taught, and towns of equal houses. Pure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cogmap.services.sim.layout.blocks import town as blocks
from cogmap.services.sim.layout.blocks.strangers import of_strangers
from cogmap.services.sim.layout.catalogue import CATALOGUE
from cogmap.services.sim.layout.place import Place

BETWEEN = "#"
"""Between what a house looks like and its number."""

HOUSE = replace(CATALOGUE[-1], name="house", width_m=6.0, depth_m=6.0, height_m=6.0)
WORKS = replace(CATALOGUE[15], name="works", width_m=6.0, depth_m=6.0, height_m=6.0)
"""Equal houses have two looks; the size is the least that a building of these towns has."""

OF_ONE_LOOK = 0.8
"""Share of a district's houses that have its usual look."""


def never_taught(seed: int) -> Place:
    """Make the town of blocks of a seed of buildings that nobody was taught: in the place of each
    one of the catalogue stands an invented one of its size.
    """
    return of_strangers(blocks.generate(seed))


def equal_houses(seed: int) -> Place:
    """Make the town of blocks of a seed with equal houses of two looks, HOUSE and WORKS, one of
    which most in a district have. Each is called after its look and its number.
    """
    place = blocks.generate(seed)
    rng = np.random.default_rng([seed, 0xE1])
    usual: dict[str, bool] = {}
    plots = []
    for number, plot in enumerate(place.plots):
        is_house = usual.setdefault(plot.district, bool(rng.random() < 0.5))
        if rng.random() >= OF_ONE_LOOK:
            is_house = not is_house
        look = HOUSE if is_house else WORKS
        kind = replace(look, name=f"{look.name}{BETWEEN}{number}")
        plots.append(replace(plot, kind=kind))

    return replace(place, plots=tuple(plots))
