"""Localization by spikes along walks, beside samples and the exact posterior."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from cogmap.cli.plots.palette import ESTIMATE, FAINT, FUSED, KERB, POSITIONS, TRUE, UNCORRECTED
from cogmap.cli.plots.sheet import describe, new_sheet
from cogmap.experiments.spiking.recursion import DRAWN, Measured
from cogmap.experiments.spiking.room import REACH_M, SIDE_M
from cogmap.geometry.arrays import Floats

COLOURS = {
    "spikes": ESTIMATE,
    "samples": FUSED,
    "spikes_from_mean": UNCORRECTED,
    "samples_from_mean": POSITIONS,
    DRAWN: FAINT,
}
LABELS = {
    "spikes": "spikes, phases reset to each",
    "samples": "samples, as many as cycles",
    "spikes_from_mean": "spikes, phases reset to their mean",
    "samples_from_mean": "samples from their mean (table 1)",
    DRAWN: "drawn from the exact posterior, as many as spikes",
}
DASHED = (0, (4, 2))


def figure(walks: Sequence[Measured]) -> Figure:
    """Draw the first walk and its errors, and all walks against the exact posterior."""
    first = walks[0]
    title = f"Move, correct, phase reset: {len(walks)} walks of {len(first.exact_m)} steps"
    with new_sheet(14.0, 8.6, title) as sheet:
        parts: Any = sheet.subfigures(2, 1)
        above, below = parts
        walk, error = above.subplots(1, 2)
        _draw_walk(walk, first)
        _draw_errors(error, first)

        distance, spread = below.subplots(1, 2)
        _draw_distances(distance, walks)
        _draw_spread(spread, walks)

    return sheet


def _draw_walk(axes: Axes, measured: Measured) -> None:
    """Draw the first walk from above; inside the dotted square no wall is in reach."""
    inside_m = SIDE_M - 2 * REACH_M
    inner = Rectangle((REACH_M, REACH_M), inside_m, inside_m, fill=False, ec=KERB, ls="dotted")
    inner.set_label("inside it no wall is sensed")
    axes.add_patch(Rectangle((0, 0), SIDE_M, SIDE_M, fill=False, ec=FAINT, lw=2, label="walls"))
    axes.add_patch(inner)

    axes.plot(*measured.walk.true_m.T, color=TRUE, lw=1.0, label="true")
    axes.plot(*measured.alone_m.T, color=KERB, lw=1.2, label="path integration alone")
    axes.plot(*measured.exact_m.T, color=FUSED, lw=1.0, ls=DASHED, label="exact posterior's mean")
    axes.plot(*measured.tracks["spikes"].mean_m.T, color=ESTIMATE, lw=1.2, label="spikes' mean")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    describe(axes, "a   the first walk", "x, m", "y, m")


def _draw_errors(axes: Axes, measured: Measured) -> None:
    """Draw the errors of the first walk over its steps; the steps with a wall in reach are
    marked.
    """
    true_m = measured.walk.true_m
    sensed = [number for number, borders in enumerate(measured.walk.borders) if borders]
    axes.plot(sensed, np.zeros(len(sensed)), "|", color=TRUE, ms=6, label="a wall is sensed")
    axes.plot(_errors_m(measured.alone_m, true_m), color=KERB, lw=1.2, label="path integration")
    exact_m = _errors_m(measured.exact_m, true_m)
    axes.plot(exact_m, color=TRUE, lw=1.0, ls=DASHED, label="exact")
    for rule, label in LABELS.items():
        if rule != DRAWN:
            error_m = _errors_m(measured.tracks[rule].mean_m, true_m)
            axes.plot(error_m, color=COLOURS[rule], lw=1.1, label=label)

    axes.set_ylim(bottom=0)
    axes.legend(frameon=False, fontsize=7.5)
    describe(axes, "b   error of the mean, first walk", "step", "m")


def _draw_distances(axes: Axes, walks: Sequence[Measured]) -> None:
    """Draw the total variation distance over the steps, the mean over the walks."""
    for rule, label in LABELS.items():
        distance = np.mean([each.tracks[rule].distance for each in walks], axis=0)
        axes.plot(distance, color=COLOURS[rule], lw=1.2, label=label)

    axes.set_ylim(0, 1)
    axes.legend(frameon=False, fontsize=7.5, loc="center right", bbox_to_anchor=(1.0, 0.4))
    title = "c   total variation distance from the exact posterior, mean of the walks"
    describe(axes, title, "step", "0 same, 1 disjoint")


def _draw_spread(axes: Axes, walks: Sequence[Measured]) -> None:
    """Draw the standard deviation of spikes and of samples over the exact one, step by step."""
    for rule in ("spikes_from_mean", "samples", "spikes"):
        exact_m = np.concatenate([each.exact_sd_m for each in walks])
        ratio = np.concatenate([each.tracks[rule].sd_ratio for each in walks])
        colour = COLOURS[rule]
        axes.plot(exact_m, exact_m * ratio, ".", ms=3, alpha=0.35, color=colour, label=LABELS[rule])

    axes.axline((0.0, 0.0), slope=1.0, color=TRUE, lw=0.8, ls=DASHED, label="the same")
    axes.set(xlim=(0, None), ylim=(0, None))
    axes.legend(frameon=False, fontsize=7.5, markerscale=3)
    title = "d   standard deviation of the posterior, each step of each walk"
    describe(axes, title, "exact, m", "of the rule, m")


def _errors_m(estimate_m: Floats, true_m: Floats) -> Floats:
    """Return the distances (n,) of (n, 2) estimates from the truth."""
    return np.asarray(np.hypot(*(estimate_m - true_m).T))
