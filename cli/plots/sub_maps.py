"""Sub-maps of cities over their streets, and what the objects of each are used for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull, QhullError

from cogmap.cli.plots.palette import FAINT, INK, KERB, PAPER, SEVERAL, STREET, USES, WALL
from cogmap.cli.plots.sheet import new_sheet
from cogmap.experiments.map_structure.functions import FUNCTIONS
from cogmap.experiments.map_structure.measure import Structured
from cogmap.geometry.arrays import Floats, Indices

COLUMNS = 2
MARGIN_M = 40.0
SCALE_M = 200.0
MAX_BARS = 24
MIN_HULL = 3
PANEL_INCHES = 7.0


def figure(found: Sequence[Structured]) -> Figure:
    """Draw the sheet: a map of each city, and beside it the functions of its sub-maps."""
    rows = -(-len(found) // COLUMNS)
    columns = min(COLUMNS, len(found))
    title = "Sub-maps of cities, and what their objects are used for"
    with new_sheet(1.4 * PANEL_INCHES * columns, PANEL_INCHES * rows, title) as sheet:
        parts: Any = sheet.subfigures(rows, columns, squeeze=False)
        for part, each in zip(parts.ravel(), found, strict=False):
            town, mixes = part.subplots(1, 2, width_ratios=(3, 1))
            _draw_city(town, each)
            _draw_functions(mixes, each)
    return sheet


def colour_of(label: int) -> str:
    """Return the colour of a sub-map."""
    return SEVERAL[label % len(SEVERAL)]


def _draw_city(axes: Axes, found: Structured) -> None:
    """Draw the streets, the boundaries, and the objects in the colours of their sub-maps."""
    city = found.city
    streets_m = city.streets.points_m[city.streets.pieces]
    axes.add_collection(LineCollection(list(streets_m), colors=STREET, linewidths=1.0, zorder=0))
    boundaries_m = list(city.boundaries_m)
    axes.add_collection(LineCollection(boundaries_m, colors=WALL, linewidths=1.4, zorder=1))

    for label in _by_size(found.labels).tolist():
        members_m = city.positions_m[found.labels == label]
        _draw_sub_map(axes, members_m, label)

    low_m = city.positions_m.min(axis=0) - MARGIN_M
    high_m = city.positions_m.max(axis=0) + MARGIN_M
    axes.set_xlim(low_m[0], high_m[0])
    axes.set_ylim(low_m[1], high_m[1])
    axes.set_aspect("equal", adjustable="box")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_facecolor(PAPER)

    left, bottom = (low_m + MARGIN_M / 2).tolist()
    axes.plot([left, left + SCALE_M], [bottom, bottom], color=INK, lw=2)
    axes.text(left, bottom + 5, f"{SCALE_M:g} m", fontsize=8, color=INK, va="bottom")
    name = city.name.replace("_", " ")
    title = f"{name}: {found.count} sub-maps of {len(city.positions_m)} objects"
    axes.set_title(title, loc="left", fontsize=11, color=INK)
    lines = [
        Line2D([], [], color=STREET, lw=2.0, label="street"),
        Line2D([], [], color=WALL, lw=1.4, label="boundary: railway, water, wall or main road"),
        Line2D(
            [], [], color=INK, ls="", marker="o", ms=2.6, label="object, in its sub-map's colour"
        ),
    ]
    axes.legend(
        handles=lines, frameon=False, fontsize=8, ncols=3, loc="upper left", bbox_to_anchor=(0, 0)
    )


def _draw_sub_map(axes: Axes, members_m: Floats, label: int) -> None:
    """Draw the objects of a sub-map, and the area that they take up, with its number."""
    colour = colour_of(label)
    axes.plot(*members_m.T, "o", ms=2.6, color=colour, mec="none", zorder=3)

    if len(members_m) >= MIN_HULL:
        try:
            hull = ConvexHull(members_m)
        except QhullError:  # they stand in one line
            return
        corners_m = members_m[hull.vertices]
        axes.add_patch(Polygon(corners_m, fc=colour, ec=colour, alpha=0.13, lw=1.0, zorder=2))

    x_m, y_m = np.median(members_m, axis=0).tolist()
    axes.text(
        x_m,
        y_m,
        str(label + 1),
        fontsize=9,
        fontweight="bold",
        color=INK,
        ha="center",
        va="center",
        zorder=4,
    )


def _draw_functions(axes: Axes, found: Structured) -> None:
    """Draw for each sub-map, from the largest, how many of its objects have which function."""
    labels = _by_size(found.labels)[:MAX_BARS]
    places = np.arange(len(labels))
    left = np.zeros(len(labels))

    for code, name in enumerate((*FUNCTIONS, "unknown")):
        wanted = code if code < len(FUNCTIONS) else -1
        is_wanted = found.city.functions == wanted
        counts = np.array([int((is_wanted & (found.labels == label)).sum()) for label in labels])
        if not counts.any():
            continue

        axes.barh(places, counts, 0.75, left=left, color=USES[code], label=name)
        left += counts

    axes.set_yticks(places, [str(label + 1) for label in labels.tolist()], fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("objects", color=FAINT)
    axes.tick_params(colors=FAINT, length=3)
    axes.set_facecolor(PAPER)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.spines["left"].set_color(KERB)
    axes.set_ylabel("sub-map, the largest first", color=FAINT)
    axes.legend(frameon=False, fontsize=8, ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))


def _by_size(labels: Indices) -> Indices:
    """Return the labels of sub-maps, from the largest."""
    names, sizes = np.unique(labels, return_counts=True)
    ordered: Indices = names[np.argsort(-sizes, kind="stable")]
    return ordered
