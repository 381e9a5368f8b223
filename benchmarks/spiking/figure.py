"""Figure 4 of the paper, from our own spikes: grid cells times border cells are place cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from benchmarks.spiking.measure import SIDE_M, Scene, recording
from benchmarks.spiking.raster import draw_raster
from cogmap.cli.plots.draw import STYLE
from cogmap.cli.plots.palette import ESTIMATE, FAINT, INK, KERB, PAPER, TRUE
from cogmap.estimation.spiking.cells import (
    PLACE_M,
    SPACINGS_M,
    BorderCells,
    GridModule,
    Spikes,
    Values,
)
from cogmap.experiments.spiking.network import Cues, Posterior, Recording

ALL_BITS = 255
DASHES = (0, (3, 2))
LineStyle = str | tuple[int, tuple[int, int]]
MOSAIC: Any = [["grid", "border", "place"], ["raster", "raster", "agreement"]]


def figure(scenes: list[Scene], seeds: Sequence[int]) -> Figure:
    """Draw the sheet: the first scene with two walls in detail, and all of `scenes` (their `seeds`)
    against Bayes' rule.
    """
    chosen = next(number for number, scene in enumerate(scenes) if len(scene.cues.borders) == 2)
    scene = scenes[chosen]
    spikes = recording(seeds[chosen])

    with mpl.rc_context(STYLE):
        sheet = Figure(figsize=(13, 8), dpi=130, facecolor=PAPER, layout="constrained")
        panels = sheet.subplot_mosaic(MOSAIC, height_ratios=[1.25, 1])
        _draw_prior(panels["grid"], scene.cues, spikes)
        _draw_likelihood(panels["border"], scene.cues, spikes)
        _show(panels["place"], spikes.counts, "c   place cells: coincidences")
        _draw_ellipse(panels["place"], scene.exact, TRUE, "-", "exact posterior, 2 SD")
        _draw_ellipse(panels["place"], scene.spiking, ESTIMATE, DASHES, "the spikes', 2 SD")
        _add_legend(panels["place"])
        draw_raster(panels["raster"], spikes)
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


def _draw_prior(axes: Axes, cues: Cues, spikes: Recording) -> None:
    """Show the counts of the cycles in which all grid cells of each place cell fired."""
    together = np.full_like(spikes.place, ALL_BITS)
    for spacing_m, fired in zip(SPACINGS_M, spikes.grid, strict=True):
        nearest = GridModule(spacing_m).nearest(spikes.centres_m)
        together &= fired[nearest]

    prior = Posterior(np.array(cues.mean_m), np.array(cues.covariance_m2))
    _show(axes, _counts(together), "a   grid cells: path integration, the prior")
    _draw_ellipse(axes, prior, TRUE, "-", "prior, 2 SD")
    _add_legend(axes)


def _draw_likelihood(axes: Axes, cues: Cues, spikes: Recording) -> None:
    """Show the counts of the cycles in which all border cells of each place cell fired."""
    cells = BorderCells(SIDE_M)
    together = np.full_like(spikes.place, ALL_BITS)
    for axis, fired in enumerate(spikes.border):
        nearest = cells.nearest(spikes.centres_m[:, axis])
        together &= fired[nearest]

    sensed_m = np.array([border.sensed_m for border in cues.borders])
    sds_m = np.array([border.sd_m for border in cues.borders])
    walls = Posterior(sensed_m, np.diag(sds_m**2))
    title = "b   border cells: distances to two walls, the likelihood"
    _show(axes, _counts(together), title)
    _draw_ellipse(axes, walls, TRUE, "-", "likelihood, 2 SD")
    _add_legend(axes)


def _counts(spikes: Spikes) -> Values:
    counts = np.bitwise_count(spikes).sum(axis=1)
    return np.asarray(counts, np.float64)


def _show(axes: Axes, counts: Values, title: str) -> None:
    """Show spikes by place, the room from above."""
    number = round(SIDE_M / PLACE_M)
    room = counts.reshape(number, number)
    axes.imshow(
        room.T,
        origin="lower",
        extent=(0, SIDE_M, 0, SIDE_M),
        cmap="YlGnBu",
    )
    axes.set_title(title, loc="left", color=INK, fontsize=10)
    axes.tick_params(colors=FAINT, length=3)
    axes.set_xlabel("metres from the west wall", color=FAINT)


def _draw_ellipse(axes: Axes, of: Posterior, colour: str, style: LineStyle, label: str) -> None:
    """Draw the ellipse of two standard deviations."""
    values, vectors = np.linalg.eigh(of.covariance_m2)
    height, width = 4 * np.sqrt(values)
    along_x, along_y = vectors[:, 1]
    angle_rad = np.arctan2(along_y, along_x)
    x_m, y_m = of.mean_m.tolist()

    ellipse = Ellipse(
        (x_m, y_m),
        width,
        height,
        angle=float(np.degrees(angle_rad)),
        fill=False,
        ec=colour,
        lw=1.6,
        ls=style,
        label=label,
    )
    axes.add_patch(ellipse)


def _add_legend(axes: Axes) -> None:
    axes.legend(frameon=False, fontsize=8, loc="lower left")


def _draw_agreement(axes: Axes, scenes: list[Scene]) -> None:
    """Draw standard deviations of the spikes over those of the exact posterior, along x and y."""
    exact = np.array([scene.exact.sd_m for scene in scenes]).ravel()
    spiking = np.array([scene.spiking.sd_m for scene in scenes]).ravel()
    least = min(exact.min(), spiking.min())
    most = max(exact.max(), spiking.max())
    limits = (0.9 * least, 1.1 * most)

    axes.plot(limits, limits, color=KERB, lw=1.2)
    axes.plot(exact, spiking, "o", ms=4.5, mfc=ESTIMATE, mec="white", mew=0.5)
    axes.set(xlim=limits, ylim=limits, aspect="equal")

    title = f"e   SD along x and y, {len(scenes)} scenes"
    axes.set_title(title, loc="left", color=INK, fontsize=10)
    axes.set_xlabel("exact, metres", color=FAINT)
    axes.set_ylabel("of the spikes, metres", color=FAINT)
    axes.tick_params(colors=FAINT, length=3)
    axes.set_facecolor(PAPER)
