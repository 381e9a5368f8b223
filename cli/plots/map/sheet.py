"""The sheet that a map is drawn on: as large as the map is wide and high, its legends below."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from cogmap.cli.plots.draw import STYLE
from cogmap.cli.plots.map.town import Handle
from cogmap.cli.plots.palette import FAINT, INK, KERB, PAPER
from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import TrueTown

X_LABEL = "X of `cogmap goal X Y`, in m: ahead of where the agent's map begins"
Y_LABEL = "Y, in m: to the left of there"

WIDTH_IN = 11.0
HIGHEST_IN = 14.0
LOWEST_IN = 3.0
"""Of the map itself, without what stands around it."""

LEFT_IN = 0.75
RIGHT_IN = 0.15
ABOVE_IN = 1.0
BELOW_IN = 0.65
ROW_IN = 0.18
"""Room for the scale of the map, for its title, and for a row of its legend."""

LINES_PT = 8.0
LINE_PT = 18.0
"""From a map to the lines below its title, and from line to line."""

COLUMNS = 2
LEGEND_PT = 8.5
DPI = 130


@contextmanager
def new_map(path: Path) -> Iterator[Axes]:
    """Yield axes to draw a map on, a metre as long ahead as aside; in the end it is written to
    `path`.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(dpi=DPI, facecolor=PAPER)
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        axes.set_facecolor(PAPER)
        axes.grid(color=KERB, lw=0.5, alpha=0.7)
        axes.set_axisbelow(True)
        axes.tick_params(colors=FAINT, length=3)
        axes.set_xlabel(X_LABEL, color=FAINT)
        axes.set_ylabel(Y_LABEL, color=FAINT)
        yield axes
        figure.savefig(path, facecolor=PAPER)


def arrange(
    axes: Axes, points_m: Floats, margin_m: float, legends: dict[str, list[Handle]]
) -> None:
    """Make a map large enough for (n, 2) points, and write its legends, by their titles, below it.

    What is drawn later is placed by where things are then.
    """
    shown_m = points_m if len(points_m) else np.zeros((1, 2))
    low_m = shown_m.min(axis=0) - margin_m
    high_m = shown_m.max(axis=0) + margin_m
    across_m, along_m = (high_m - low_m).tolist()
    height_in = min(HIGHEST_IN, max(LOWEST_IN, WIDTH_IN * along_m / across_m))
    rows = max(math.ceil(len(handles) / COLUMNS) for handles in legends.values()) + 2
    below_in = BELOW_IN + rows * ROW_IN

    figure = axes.get_figure(root=True)
    assert figure is not None
    whole_width_in = LEFT_IN + WIDTH_IN + RIGHT_IN
    whole_height_in = below_in + height_in + ABOVE_IN
    figure.set_size_inches(whole_width_in, whole_height_in)
    axes.set_position(
        (
            LEFT_IN / whole_width_in,
            below_in / whole_height_in,
            WIDTH_IN / whole_width_in,
            height_in / whole_height_in,
        )
    )
    # Limits that have another shape than the map are widened.
    axes.set_xlim(low_m[0], high_m[0])
    axes.set_ylim(low_m[1], high_m[1])
    axes.set_aspect("equal", adjustable="datalim")
    axes.apply_aspect()

    top = -BELOW_IN / height_in
    for number, (title, handles) in enumerate(legends.items()):
        _add_legend(axes, title, handles, (number / len(legends), top))


def write_title(axes: Axes, title: str, lines: list[str]) -> None:
    """Write a title above a map, and lines below the title."""
    above_pt = LINES_PT + LINE_PT * len(lines)
    written = f"{title[:1].upper()}{title[1:]}"
    axes.set_title(written, loc="left", pad=above_pt, color=INK, fontsize=14, fontweight="bold")
    axes.annotate(
        "\n".join(lines),
        (0.0, 1.0),
        (0.0, LINES_PT),
        xycoords="axes fraction",
        textcoords="offset points",
        color=INK,
        va="bottom",
        linespacing=1.5,
    )


def extent_m(town: TrueTown) -> Floats:
    """Return points (n, 2) between which the streets and buildings of a town lie."""
    corners = []
    for street in town.streets:
        reach_m = street.width_m / 2
        for x_m, y_m in street.line_m:
            corners += [(x_m - reach_m, y_m - reach_m), (x_m + reach_m, y_m + reach_m)]

    for building in town.buildings:
        reach_m = max(building.width_m, building.depth_m) / 2
        x_m, y_m = building.pose.x_m, building.pose.y_m
        corners += [(x_m - reach_m, y_m - reach_m), (x_m + reach_m, y_m + reach_m)]

    return np.array(corners, np.float64).reshape(-1, 2)


def px_per_m(axes: Axes) -> float:
    """Return how many pixels of the picture a metre of an arranged map takes."""
    (left, _), (right, _) = axes.transData.transform([(0.0, 0.0), (1.0, 0.0)]).tolist()
    return float(right - left)


def m_per_pt(axes: Axes) -> float:
    """Return how many metres of an arranged map a point of letters takes."""
    return DPI / 72 / px_per_m(axes)


def _add_legend(axes: Axes, title: str, handles: list[Handle], place: tuple[float, float]) -> None:
    """Write a legend from a place on, which is in shares of the map's width and height."""
    names = [str(handle.get_label()) for handle in handles]
    legend = Legend(
        axes,
        handles,
        names,
        title=title,
        loc="upper left",
        bbox_to_anchor=place,
        ncols=COLUMNS,
        frameon=False,
        fontsize=LEGEND_PT,
        borderaxespad=0.0,
        alignment="left",
    )
    legend.get_title().set(fontweight="bold", color=INK)
    axes.add_artist(legend)
