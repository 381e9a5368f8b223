"""Draws map.png: the town as it is, and as the agent has come to know it."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from cogmap.cli.launch.drive_metrics import RecordedMetrics, headline, judged
from cogmap.cli.launch.observer import Observer
from cogmap.cli.launch.tally import Tally
from cogmap.cli.plots import map_layers as layers
from cogmap.cli.plots import palette
from cogmap.cli.plots.map_structure import draw_structure
from cogmap.cli.plots.palette import ESTIMATE, FAINT, FUSED, INK, PAPER, TRUE, WHEELS
from cogmap.cli.plots.town_layer import CHARGING_MARKER, draw_town

MARGIN_M = 5.0
ROADSIDE_M = 20.0
"""The margin where no town is known: what was learned stands beside the path."""
SCALE_M = 10.0
DASHED = (0, (4, 2))
DOTTED = (0, (1, 1.2))


def draw(path: Path, tally: Tally, metrics: RecordedMetrics) -> None:
    """Write the map to `path` as a PNG."""
    observer = tally.observer
    graph = tally.replica.graph
    with mpl.rc_context(
        {"font.family": "sans-serif", "font.size": 9, "axes.edgecolor": palette.KERB}
    ):
        figure = Figure(figsize=(11, 10), dpi=130, facecolor=PAPER, layout="constrained")
        axes = figure.add_subplot()
        axes.set_facecolor(PAPER)
        if observer.town is not None:
            draw_town(axes, observer.town)
        layers.draw_road(axes, observer, graph)
        layers.draw_objects(axes, observer, graph, judged(tally))

        axes.plot(*observer.wheels_path_m.T, color=WHEELS, lw=1.6, ls=DASHED, zorder=8)
        axes.plot(
            *observer.true_path_m.T, color=TRUE, lw=3.2, alpha=0.9, solid_capstyle="round", zorder=9
        )
        axes.plot(*observer.fused_path_m.T, color=FUSED, lw=1.4, ls=DOTTED, zorder=9.5)
        axes.plot(*observer.estimated_path_m.T, color=ESTIMATE, lw=1.5, zorder=10)

        if observer.start is not None:
            axes.plot(
                observer.start.x_m,
                observer.start.y_m,
                "o",
                ms=9,
                mfc="white",
                mec=TRUE,
                mew=2,
                zorder=11,
            )

        structure = draw_structure(axes, observer, graph)
        _dress(axes, observer, metrics, structure)
        figure.savefig(path, facecolor=PAPER)


def _dress(
    axes: Axes, observer: Observer, metrics: RecordedMetrics, structure: list[Line2D]
) -> None:
    """Set limits, scale, title and legend."""
    town = observer.town
    corners = [point for street in (town.streets if town else []) for point in street.line_m]
    for building in town.buildings if town else []:
        reach_m = max(building.width_m, building.depth_m) / 2
        corners += [
            (building.pose.x_m + side * reach_m, building.pose.y_m + side * reach_m)
            for side in (-1, 1)
        ]
    every = np.vstack(
        [
            np.array(corners).reshape(-1, 2),
            observer.true_path_m,
            observer.wheels_path_m,
            observer.fused_path_m,
            observer.estimated_path_m,
        ]
    )
    if len(every):
        margin_m = MARGIN_M if town is not None else ROADSIDE_M
        (west, south), (east, north) = every.min(axis=0) - margin_m, every.max(axis=0) + margin_m
        axes.set_xlim(west, east)
        axes.set_ylim(south, north)
        axes.plot(
            [west + 2.0, west + 2.0 + SCALE_M],
            [south + 2.0, south + 2.0],
            color=INK,
            lw=3,
            solid_capstyle="butt",
            zorder=12,
        )
        axes.text(
            west + 2.0 + SCALE_M / 2,
            south + 2.0 + 0.7,
            f"{SCALE_M:g} m",
            ha="center",
            color=INK,
            zorder=12,
        )
    axes.set_aspect("equal")
    axes.tick_params(colors=FAINT, length=3)
    axes.set_xlabel("x, metres east", color=FAINT)
    axes.set_ylabel("y, metres north", color=FAINT)

    place = metrics.recording or f"Town {metrics.seed}"
    driven = f"{place}, driven through for {metrics.distance_m:.0f} m in {metrics.drive_s:.0f} s"
    learned = f"buildings: {headline(metrics)}; {metrics.road_m2:.0f} m² of street learned"
    errors = (
        f"position error {metrics.estimate.mean_m:.2f} m on average; "
        f"{metrics.fused_alone.mean_m:.2f} m by fused self-motion alone"
    )
    if metrics.wheels_alone.is_measured:
        errors = f"{errors}, {metrics.wheels_alone.mean_m:.2f} m by wheels alone"
    axes.set_title(f"{driven}\n\n", loc="left", color=INK, fontsize=14, fontweight="bold")
    axes.text(
        0,
        1.012,
        f"{learned}\n{errors}",
        transform=axes.transAxes,
        color=INK,
        va="bottom",
        linespacing=1.5,
    )
    axes.legend(
        handles=[*_legend(observer), *_charging_legend(metrics), *structure],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.06),
        ncols=4,
        frameon=False,
        fontsize=8.5,
    )


def _charging_legend(metrics: RecordedMetrics) -> list[Line2D]:
    """Return the legend of charging places, if the robot's battery runs down."""
    if metrics.energy is None:
        return []
    return [Line2D([], [], label="charging place", **CHARGING_MARKER)]


def _legend(observer: Observer) -> list[Patch | Line2D]:
    """Return the legend of what is drawn of every drive, and of the town if it is known."""
    of_town: list[Patch | Line2D] = []
    if observer.town is not None:
        of_town.append(Patch(fc=palette.STREET, ec=palette.KERB, label="street"))
        of_town.append(Patch(fc=palette.HOUSE, ec=palette.WALL, label="building"))

    return [
        *of_town,
        Line2D([], [], color=TRUE, lw=3.2, label="true path"),
        Line2D([], [], color=ESTIMATE, lw=1.5, label="estimated path"),
        Line2D([], [], color=FUSED, lw=1.4, ls=DOTTED, label="fused self-motion alone"),
        Line2D([], [], color=WHEELS, lw=1.6, ls=DASHED, label="wheels alone"),
        Patch(fc=palette.ROAD, alpha=palette.ROAD_OPACITY, label="learned street"),
        Line2D(
            [],
            [],
            marker="o",
            ls="",
            mfc=palette.OBJECT,
            mec="white",
            label="learned building, its samples and 2 SD",
        ),
        Line2D([], [], color=palette.OBJECT, lw=1.0, label="its error"),
    ]
