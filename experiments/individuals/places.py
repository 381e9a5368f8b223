"""Towns of buildings that nobody was taught, and towns of equal houses. Pure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cogmap.services.sim.layout.blocks import town as blocks
from cogmap.services.sim.layout.catalogue import CATALOGUE, BuildingType, invented
from cogmap.services.sim.layout.place import Place

BETWEEN = "#"
"""Between what a house looks like and its number."""

GATES = "gates"
"""A pattern that needs a wide front."""

GATES_WIDTH_M = 9.0
HOUSE = replace(CATALOGUE[-1], name="house", width_m=6.0, depth_m=6.0, height_m=6.0)
WORKS = replace(CATALOGUE[15], name="works", width_m=6.0, depth_m=6.0, height_m=6.0)
"""Equal houses have two looks; the size is the least that a building of these towns has."""

OF_ONE_LOOK = 0.8
"""Share of a district's houses that have its usual look."""

_TAUGHT = frozenset(kind.name for kind in CATALOGUE)


def never_taught(seed: int) -> Place:
    """Make the town of blocks of a seed of buildings that nobody was taught: in the place of each
    one of the catalogue stands an invented one of its size.
    """
    place = blocks.generate(seed)
    taught = [plot for plot in place.plots if plot.kind.name in _TAUGHT]

    # Twice as many: some cannot be as narrow as what they replace.
    drawn = list(invented(seed, 2 * len(taught)))
    plots = []
    for plot in place.plots:
        if plot.kind.name in _TAUGHT:
            kind = _as_large(drawn, plot.kind)
            plots.append(replace(plot, kind=kind))
        else:
            plots.append(plot)

    return replace(place, plots=tuple(plots))


def _as_large(drawn: list[BuildingType], kind: BuildingType) -> BuildingType:
    """Take the first of the kinds drawn that can be as large as `kind`, in that size."""
    fits = [each for each in drawn if each.pattern != GATES or kind.width_m >= GATES_WIDTH_M]
    chosen = fits[0]
    drawn.remove(chosen)
    return replace(chosen, width_m=kind.width_m, depth_m=kind.depth_m, height_m=kind.height_m)


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
