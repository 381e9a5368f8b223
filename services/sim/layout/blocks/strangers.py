"""Towns of buildings that nobody was taught. Pure."""

from __future__ import annotations

from dataclasses import replace

from cogmap.services.sim.layout.blocks.town import BlocksTown
from cogmap.services.sim.layout.catalogue import CATALOGUE, BuildingType, invented

GATES = "gates"
"""A pattern that needs a wide front."""

GATES_WIDTH_M = 9.0
_TAUGHT = frozenset(kind.name for kind in CATALOGUE)


def of_strangers(place: BlocksTown) -> BlocksTown:
    """Return the town with an invented building in the place of each one of the catalogue, of its
    size.
    """
    taught = [plot for plot in place.plots if plot.kind.name in _TAUGHT]

    # Twice as many: some cannot be as narrow as what they replace.
    drawn = list(invented(place.seed, 2 * len(taught)))
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
