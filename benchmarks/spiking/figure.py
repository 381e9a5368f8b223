"""Figure 4 of the paper, from our own spikes: grid cells times border cells are place cells."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from benchmarks.spiking.measure import SIDE_M, Scene, recording
from cli.plots.draw import STYLE
from cli.plots.palette import ESTIMATE, FAINT, INK, KERB, OBJECT, PAPER, TRUE
from experiments.spiking.cells import (
    GAMMA_S,
    PLACE_M,
    SPACINGS_M,
    BorderCells,
    GridModule,
    Spikes,
    Values,
)
from experiments.spiking.network import Posterior, Recording

SHOWN_S = 2.0
MOSAIC: Any = [["grid", "border", "place"], ["raster", "raster", "agreement"]]


def figure(scenes: list[Scene], seeds: list[int]) -> Figure:
    """The sheet: the first scene with two walls in detail, and all of `scenes` (their `seeds`)
    against Bayes' rule.
    """
    chosen = next(number for number, scene in enumerate(scenes) if len(scene.cues.borders) == 2)
    scene = scenes[chosen]
    spikes = recording(seeds[chosen])
    with mpl.rc_context(STYLE):
        sheet = Figure(figsize=(13, 8), dpi=130, facecolor=PAPER, layout="constrained")
        panels = sheet.subplot_mosaic(MOSAIC, height_ratios=[1.25, 1])
        _draw_inputs(panels, scene, spikes)
        _show(panels["place"], spikes.counts, "c   place cells: coincidences")
        _draw_ellipse(panels["place"], scene.exact, TRUE, "-", "exact posterior, 2 SD")
        _draw_ellipse(panels["place"], scene.spiking, ESTIMATE, (0, (3, 2)), "the spikes', 2 SD")
        panels["place"].legend(frameon=False, fontsize=8, loc="lower left")
        _draw_raster(panels["raster"], spikes)
        _draw_agreement(panels["agreement"], scenes)
        sheet.suptitle(
            f"Cue integration by coincidence: {scene.spikes} spikes of place cells, "
            "samples of the posterior",
            x=0.01,
            ha="left",
            color=INK,
            fontsize=13,
            fontweight="bold",
        )
        sheet.draw_without_rendering()
    return sheet


def _inputs(spikes: Recording) -> tuple[Values, Values]:
    """How often the grid cells of each place cell fired together, and how often its border cells
    did.
    """
    grid = np.full_like(spikes.place, 255)
    for spacing_m, fired in zip(SPACINGS_M, spikes.grid, strict=True):
        grid &= fired[GridModule(spacing_m).nearest(spikes.centres_m)]
    border = np.full_like(spikes.place, 255)
    for axis, fired in enumerate(spikes.border):
        border &= fired[BorderCells(SIDE_M).nearest(spikes.centres_m[:, axis])]
    return _counts(grid), _counts(border)


def _counts(spikes: Spikes) -> Values:
    return np.asarray(np.bitwise_count(spikes).sum(axis=1), np.float64)


def _draw_inputs(panels: dict[str, Axes], scene: Scene, spikes: Recording) -> None:
    grid, border = _inputs(spikes)
    _show(panels["grid"], grid, "a   grid cells: path integration, the prior")
    _show(panels["border"], border, "b   border cells: distances to two walls, the likelihood")
    prior = Posterior(np.array(scene.cues.mean_m), np.array(scene.cues.covariance_m2))
    sensed = scene.cues.borders
    walls = Posterior(
        np.array([each.sensed_m for each in sensed]), np.diag([each.sd_m**2 for each in sensed])
    )
    _draw_ellipse(panels["grid"], prior, TRUE, "-", "prior, 2 SD")
    _draw_ellipse(panels["border"], walls, TRUE, "-", "likelihood, 2 SD")
    for name in ("grid", "border"):
        panels[name].legend(frameon=False, fontsize=8, loc="lower left")


def _show(axes: Axes, counts: Values, title: str) -> None:
    """Spikes by place, the room from above."""
    number = round(SIDE_M / PLACE_M)
    axes.imshow(
        counts.reshape(number, number).T,
        origin="lower",
        extent=(0, SIDE_M, 0, SIDE_M),
        cmap="YlGnBu",
    )
    axes.set_title(title, loc="left", color=INK, fontsize=10)
    axes.tick_params(colors=FAINT, length=3)
    axes.set_xlabel("metres from the west wall", color=FAINT)


def _draw_ellipse(
    axes: Axes, of: Posterior, colour: str, style: str | tuple[int, tuple[int, int]], label: str
) -> None:
    values, vectors = np.linalg.eigh(of.covariance_m2)
    width, height = 4 * np.sqrt(values[::-1])
    angle = float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
    where = (float(of.mean_m[0]), float(of.mean_m[1]))
    axes.add_patch(
        Ellipse(
            where, width, height, angle=angle, fill=False, ec=colour, lw=1.6, ls=style, label=label
        )
    )


def _draw_raster(axes: Axes, spikes: Recording) -> None:
    """The inputs of the place cell that fires most, and its own spikes where all coincide."""
    most = int(np.argmax(spikes.counts))
    cell = spikes.centres_m[most : most + 1]
    rows = [("place cell", spikes.place[most], ESTIMATE)]
    rows += [
        (f"border cell, {'west' if axis == 0 else 'south'} wall", fired[int(nearest[0])], OBJECT)
        for axis, fired in enumerate(spikes.border)
        for nearest in (BorderCells(SIDE_M).nearest(cell[:, axis]),)
    ]
    rows += [
        (f"grid cell, {spacing_m:g} m", fired[int(GridModule(spacing_m).nearest(cell)[0])], TRUE)
        for spacing_m, fired in zip(SPACINGS_M, spikes.grid, strict=True)
    ]
    first = int(np.flatnonzero(np.unpackbits(rows[0][1]))[0])
    shown = round(SHOWN_S / GAMMA_S)
    from_cycle = max(0, first - shown // 2)
    for height, (_, packed, colour) in enumerate(rows):
        fired = np.flatnonzero(np.unpackbits(packed)[from_cycle : from_cycle + shown]) * GAMMA_S
        axes.vlines(fired, height - 0.4, height + 0.4, color=colour, lw=1.4)
    for coincidence in (
        np.flatnonzero(np.unpackbits(rows[0][1])[from_cycle : from_cycle + shown]) * GAMMA_S
    ):
        axes.axvline(coincidence, color=ESTIMATE, lw=6, alpha=0.15, zorder=0)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    axes.set_xlim(0, SHOWN_S)
    axes.set_xlabel("seconds", color=FAINT)
    axes.set_title(
        "d   a place cell and its inputs: it fires where all fire together",
        loc="left",
        color=INK,
        fontsize=10,
    )
    axes.set_facecolor(PAPER)


def _draw_agreement(axes: Axes, scenes: list[Scene]) -> None:
    exact = np.array([scene.exact.sd_m for scene in scenes]).ravel()
    spiking = np.array([scene.spiking.sd_m for scene in scenes]).ravel()
    limits = (0.9 * min(exact.min(), spiking.min()), 1.1 * max(exact.max(), spiking.max()))
    axes.plot(limits, limits, color=KERB, lw=1.2)
    axes.plot(exact, spiking, "o", ms=4.5, mfc=ESTIMATE, mec="white", mew=0.5)
    axes.set(xlim=limits, ylim=limits, aspect="equal")
    axes.set_title(
        f"e   SD along x and y, {len(scenes)} scenes", loc="left", color=INK, fontsize=10
    )
    axes.set_xlabel("exact, metres", color=FAINT)
    axes.set_ylabel("of the spikes, metres", color=FAINT)
    axes.tick_params(colors=FAINT, length=3)
    axes.set_facecolor(PAPER)
