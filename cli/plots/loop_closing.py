"""Figure 6 of the paper, from our own run: a loop before and after it is closed, and what the
replay predicts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cogmap.cli.plots.palette import (
    CUT,
    ESTIMATE,
    FAINT,
    FUSED,
    OBJECT,
    POSITIONS,
    ROAD,
    TRUE,
    UNCORRECTED,
)
from cogmap.cli.plots.sheet import describe, new_sheet
from cogmap.experiments.loop_closing.observer import Loop, Map
from cogmap.experiments.loop_closing.run import SENSING
from cogmap.experiments.loop_closing.solvers import (
    EQ9,
    GAUSS_SEIDEL,
    OVER_LOOPS,
    REPLAY,
    Solvers,
)
from cogmap.experiments.predictions.replayed import Replayed

DASHED = (0, (4, 2))
SOLVERS = {
    GAUSS_SEIDEL: ("Gauss-Seidel, positions", FUSED),
    OVER_LOOPS: ("Gauss-Seidel, loops", CUT),
    EQ9: ("eq. 9 as printed", OBJECT),
    REPLAY: ("reverse replay", POSITIONS),
}
LEAST_SHOWN_M = 1e-3
MAX_MARKED = 100


def figure(loops: dict[str, Loop], solved: Solvers, metrics: dict[str, Any]) -> Figure:
    """Draw the sheet: the map before, right after, and in the end with headings; below, the first
    replay, and how fast it solves the loop.
    """
    positions = loops["positions"]
    heading = loops["heading"]
    title = f"A loop of {len(positions.before.path_m)} places, {SENSING}, wheels as the town's"
    with new_sheet(14.0, 9.0, title) as sheet:
        parts: Any = sheet.subfigures(2, 1, height_ratios=(1.5, 1))
        above, below = parts
        before, after, end = above.subplots(1, 3, sharex=True, sharey=True)
        _draw_map(before, positions.before, UNCORRECTED, "a   before")
        replayed = "b   after the first replay, positions only (eq. 9)"
        _draw_map(after, positions.after, POSITIONS, replayed)
        _draw_shifts(after, positions.before, positions.after)
        _draw_map(end, heading.end, ESTIMATE, "c   in the end, headings corrected too")
        end.set_xlabel(f"x, m\n{_alone(metrics)}")
        above.legend(
            handles=_legend(), frameon=False, fontsize=8.5, ncols=5, loc="outside upper left"
        )

        shifts, synapses, passes = below.subplots(1, 3)
        _draw_replay(shifts, positions.replays[0])
        _draw_synapses(synapses, positions.replays[0], metrics)
        _draw_solvers(passes, solved)
    return sheet


def _alone(metrics: dict[str, Any]) -> str:
    """Write what the path errs by path integration alone."""
    fused_m = metrics["path_error_fused_alone_m"]
    wheels_m = metrics["path_error_wheels_alone_m"]
    return f"path by fused self-motion alone {fused_m:.1f} m, by wheels alone {wheels_m:.1f} m"


def _legend() -> list[Line2D]:
    """Return the legend of the maps."""
    square: dict[str, Any] = {"marker": "s", "ls": ""}
    point: dict[str, Any] = {"marker": "o", "ls": "", "ms": 8, "mec": "white"}
    return [
        Line2D([], [], color=TRUE, lw=1.0, ls=DASHED, label="where the agent was"),
        Line2D([], [], color=UNCORRECTED, lw=1.8, label="where it believes that it was: before"),
        Line2D([], [], color=POSITIONS, lw=1.8, label="after the first replay"),
        Line2D([], [], color=ESTIMATE, lw=1.8, label="in the end"),
        Line2D([], [], color=FAINT, lw=0.7, label="shifts of places"),
        Line2D([], [], ms=5, color=TRUE, label="building", **square),
        Line2D([], [], ms=6, color=OBJECT, label="learned building", **square),
        Line2D([], [], color=OBJECT, lw=0.8, ls="dotted", label="its error"),
        Line2D([], [], ms=6, color=ROAD, alpha=0.5, label="learned road", **square),
        Line2D(
            [],
            [],
            mfc="white",
            label="start; its end has the path's colour",
            **point | {"mec": TRUE},
        ),
    ]


def _draw_map(axes: Axes, drawn: Map, colour: str, title: str) -> None:
    axes.plot(*drawn.road_m.T, "s", ms=3.0, color=ROAD, alpha=0.4, mew=0, zorder=1)
    axes.plot(*drawn.true_path_m.T, color=TRUE, lw=1.0, ls=DASHED, zorder=2)
    axes.plot(*drawn.path_m.T, color=colour, lw=1.8, zorder=3)
    lines = np.stack([drawn.true_objects_m, drawn.objects_m], axis=1)
    axes.add_collection(
        LineCollection(list(lines), colors=OBJECT, linewidths=0.8, linestyles="dotted")
    )
    axes.plot(*drawn.true_objects_m.T, "s", ms=4.5, color=TRUE, mec="white", zorder=4)
    axes.plot(*drawn.objects_m.T, "s", ms=5.5, color=OBJECT, mec="white", zorder=5)
    axes.plot(*drawn.path_m[0], "o", ms=8, mfc="white", mec=TRUE, zorder=6)
    axes.plot(*drawn.path_m[-1], "o", ms=8, color=colour, mec="white", zorder=6)
    axes.set_aspect("equal", adjustable="box")
    errors = (
        f"error: path {drawn.path_error_m:.1f} m, buildings {drawn.object_error_m:.1f} m, "
        f"end {drawn.end_error_m:.1f} m"
    )
    describe(axes, f"{title}\n{errors}", "x, m", "y, m")


def _draw_shifts(axes: Axes, before: Map, after: Map) -> None:
    """Draw lines from where some places were taken to be, to where they are now."""
    count = min(len(before.path_m), len(after.path_m))
    lines = np.stack([before.path_m[:count], after.path_m[:count]], axis=1)[:: max(1, count // 40)]
    axes.add_collection(LineCollection(list(lines), colors=FAINT, linewidths=0.7, zorder=2))


def _draw_replay(axes: Axes, replay: Replayed) -> None:
    axes.plot(np.arange(len(replay.shifts_m)), replay.shifts_m, color=POSITIONS, lw=1.8)
    axes.set_ylim(bottom=0)
    title = "d   shift of each place field, in the order of the replay"
    describe(axes, title, "places, from the one met again backwards", "shift, m")


def _draw_synapses(axes: Axes, replay: Replayed, metrics: dict[str, Any]) -> None:
    """Plot pairs of place fields near one another; those brought together from afar would lie far
    outside, near 1.
    """
    nearer = replay.nearer_m[replay.close]
    changes = replay.strength_changes[replay.close]
    slope = metrics["strength_change_per_m_close_pairs"]
    r = metrics["strength_and_shift_correlation_close_pairs"]
    axes.axline((0.0, 0.0), slope=slope, color=FAINT, lw=1.0, ls=(0, (4, 2)))
    axes.plot(nearer, changes, ".", ms=5, color=POSITIONS, alpha=0.6)
    title = f"e   predicted change of synapses, fields under {1 / replay.decay_per_m:g} m apart"
    describe(
        axes,
        f"{title}:\n{slope:.3f} a metre, r = {r:.2f}",
        "by how much two place fields come nearer, m",
        f"change of exp(-{replay.decay_per_m:g} d)",
    )


def _draw_solvers(axes: Axes, solved: Solvers) -> None:
    """Plot how far the path is from that of the least cost, pass by pass."""
    for name, (label, colour) in SOLVERS.items():
        apart_m = solved.curves[name].from_solution_m
        shown = np.flatnonzero(apart_m >= LEAST_SHOWN_M)
        marker = "." if len(apart_m) <= MAX_MARKED else ""
        axes.plot(shown, apart_m[shown], marker=marker, lw=1.4, color=colour, label=label)

    axes.set_xscale("symlog", linthresh=1)
    axes.set_xlim(left=0)
    axes.set_yscale("log")
    axes.legend(frameon=False, fontsize=8)
    title = "f   the loop of b, from path integration alone"
    describe(axes, title, "passes over the path", "from the least of eq. 7, m")
