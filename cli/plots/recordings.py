"""A recording of place cells beside the paper's predictions (§5.6), and beside a drive's."""

from __future__ import annotations

from textwrap import shorten

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cogmap.cli.plots.palette import ESTIMATE, FAINT, POSITIONS, TRUE
from cogmap.cli.plots.predictions import LEGEND
from cogmap.cli.plots.sheet import describe, new_sheet
from cogmap.experiments.predictions.drive import Drive
from cogmap.experiments.predictions.measure import Estimate, Found, Replays, Shifts, Synapses
from cogmap.experiments.predictions.replayed import strength_fit

TITLE_WIDTH = 150


def figure(found: Found, drive: Drive | None) -> Figure:
    """Draw the three predictions in a recording, a panel each; a drive's are scaled to its loop."""
    recording = found.recording
    title = shorten(f"{recording.name}: {recording.description}", TITLE_WIDTH)
    with new_sheet(15.0, 5.2, title) as sheet:
        replays, shifts, synapses = sheet.subplots(1, 3)
        _draw_replays(replays, found, found.replays, drive)
        _draw_shifts(shifts, found, found.shifts, drive)
        _draw_synapses(synapses, found.synapses, drive)
    return sheet


def _draw_replays(axes: Axes, found: Found, replays: Replays, drive: Drive | None) -> None:
    peaks = np.array([cell.peak_m for cell in found.cells]) / found.loop.length_m
    axes.plot(peaks, replays.replays, "o", ms=4, color=ESTIMATE, label="in reverse replays")
    axes.plot(peaks, replays.revisits, "_", ms=7, color=TRUE, label="passed again")
    axes.set_ylim(0, 1.25 * max(replays.replays.max(), replays.revisits.max(), 1))
    lines = [
        f"a   reverse replay more often than revisits: {replays.verdict.value}",
        f"{replays.tested} events: {replays.reverse} reverse ({replays.by_chance:.1f} by chance), "
        f"{replays.forward} forward",
        f"over revisits {_value(replays.ratio)}",
    ]
    if drive is not None:
        lines[2] += f"; the drive {drive.passes} over {drive.revisits}"
    axes.legend(loc="upper right", **LEGEND)
    x = "place field, share of the loop"
    describe(axes, "\n".join(lines), x, "times since the loop was closed")


def _draw_shifts(axes: Axes, found: Found, shifts: Shifts, drive: Drive | None) -> None:
    behind = shifts.from_closure_m / found.loop.length_m
    sizes_m = np.abs(shifts.shift_m)
    axes.plot(behind, shifts.usual_m, "_", ms=7, color=TRUE, label="from pass to pass, later")
    axes.plot(behind, sizes_m, "o", ms=4, color=ESTIMATE, label="since the first revisit")
    if drive is not None and len(sizes_m):
        first = drive.corrections[0]
        scale = sizes_m.mean() / max(first.shifts_m.mean(), 1e-12)
        label = "the drive's first correction, scaled to their mean"
        shares = first.behind_m / first.behind_m[-1]
        axes.plot(shares, first.shifts_m * scale, color=POSITIONS, lw=1.4, label=label)
    axes.set_ylim(0, 1.4 * max(sizes_m.max(initial=0.0), shifts.usual_m.max(initial=0.0), 0.01))
    axes.legend(loc="upper right", **LEGEND)
    lines = [
        f"b   place fields shift after a revisit: {shifts.verdict.value}",
        f"more than usual, m: {_value(shifts.excess)}",
        f"less far from the closure, rho: {_value(shifts.decline)}",
    ]
    x = "from the closure back, share of the loop"
    describe(axes, "\n".join(lines), x, "shift of the field, m")


def _draw_synapses(axes: Axes, synapses: Synapses, drive: Drive | None) -> None:
    nearer_m = synapses.nearer_m[synapses.close]
    change = synapses.change[synapses.close]
    axes.plot(nearer_m, change, ".", ms=5, color=ESTIMATE, alpha=0.7, label="close pairs")
    lines = [
        f"c   synapses change with the shifts: {synapses.verdict.value}",
        f"for a metre nearer: {_value(synapses.slope)}",
        f"{len(change)} pairs",
    ]
    if synapses.slope is not None:
        middle = (float(nearer_m.mean()), float(change.mean()))
        axes.axline(middle, slope=synapses.slope.value, color=ESTIMATE, lw=1.0)
        lines[2] += f", rho {synapses.correlation:.2f}"
    if drive is not None:
        r = strength_fit("r", drive.corrections[0], drive.corrections[0].close)
        lines[2] += f"; the drive's synapses r = {r['strength_and_shift_correlation_r']:.2f}"
    axes.axhline(0.0, color=FAINT, lw=0.7)
    axes.legend(loc="upper left", **LEGEND)
    x = "by how much two place fields come nearer, m"
    describe(axes, "\n".join(lines), x, "change of their correlation in rest")


def _value(estimate: Estimate | None) -> str:
    """Write a value with its interval and p."""
    if estimate is None:
        return "undecided"
    return f"{estimate.value:.2g} ({estimate.low:.2g} to {estimate.high:.2g}, p = {estimate.p:.2g})"
