"""The panel of one place cell and its inputs over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from benchmarks.spiking.measure import SIDE_M
from cogmap.cli.plots.palette import ESTIMATE, FAINT, INK, OBJECT, PAPER, TRUE
from cogmap.estimation.spiking.cells import (
    GAMMA_S,
    SPACINGS_M,
    BorderCells,
    GridModule,
    Spikes,
    Values,
)
from cogmap.experiments.spiking.network import WEST, Recording

SHOWN_S = 2.0
HALF_HEIGHT = 0.4


@dataclass(frozen=True, eq=False)
class Train:
    """The spikes of one cell, as bits packed by eight cycles."""

    name: str
    spikes: Spikes
    colour: str

    @property
    def cycles(self) -> Spikes:
        """Return 1 in each cycle with a spike, 0 in others."""
        return np.unpackbits(self.spikes)

    def times_s(self, first_cycle: int) -> Values:
        """Return the times of its spikes within SHOWN_S of `first_cycle`, in seconds from there."""
        end_cycle = first_cycle + round(SHOWN_S / GAMMA_S)
        shown = self.cycles[first_cycle:end_cycle]
        cycles = np.flatnonzero(shown).astype(np.float64)
        return cycles * GAMMA_S


def draw_raster(axes: Axes, spikes: Recording) -> None:
    """Draw the inputs of the place cell that fires most, and its own spikes when all coincide."""
    most = int(np.argmax(spikes.counts))
    place = Train("place cell", spikes.place[most], ESTIMATE)

    # The border cells and the grid cells that it fires with.
    trains = [place]
    centre_m = spikes.centres_m[most : most + 1]
    for axis, fired in enumerate(spikes.border):
        wall = "west" if axis == WEST else "south"
        (cell,) = BorderCells(SIDE_M).nearest(centre_m[:, axis])
        trains.append(Train(f"border cell, {wall} wall", fired[cell], OBJECT))

    for spacing_m, fired in zip(SPACINGS_M, spikes.grid, strict=True):
        (cell,) = GridModule(spacing_m).nearest(centre_m)
        trains.append(Train(f"grid cell, {spacing_m:g} m", fired[cell], TRUE))

    first_spike = int(np.flatnonzero(place.cycles)[0])
    shown = round(SHOWN_S / GAMMA_S)
    first_cycle = max(0, first_spike - shown // 2)

    for height, train in enumerate(trains):
        bottom = height - HALF_HEIGHT
        top = height + HALF_HEIGHT
        axes.vlines(train.times_s(first_cycle), bottom, top, color=train.colour, lw=1.4)

    for coincidence_s in place.times_s(first_cycle):
        axes.axvline(coincidence_s, color=ESTIMATE, lw=6, alpha=0.15, zorder=0)

    axes.set_yticks(range(len(trains)), [train.name for train in trains])
    axes.set_xlim(0, SHOWN_S)
    axes.set_xlabel("seconds", color=FAINT)
    axes.set_title(
        "d   a place cell and its inputs: it fires when all fire together",
        loc="left",
        color=INK,
        fontsize=10,
    )
    axes.set_facecolor(PAPER)
