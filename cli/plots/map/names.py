"""The names on a map: of streets and buildings where there is room, none over another, and of
places that are marked.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import matplotlib.patheffects as outlines
import numpy as np
from matplotlib.axes import Axes
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from cogmap.cli.plots.draw import spoken
from cogmap.cli.plots.labels import Label
from cogmap.cli.plots.map.sheet import m_per_pt, px_per_m
from cogmap.cli.plots.palette import INK, PAPER
from cogmap.schemas.sensing import Building, Street, TrueTown

SIZES_PT = (6.5, 5.5, 4.5)
"""Sizes of letters that are tried, from the largest; smaller ones nobody reads in print."""

LEVEL_RAD = 0.05
"""What is turned by less from the axes is as good as along them."""

ORDER = 15
ABOVE_PT = 9.0
"""From a start or a goal to its name, which stands above the marker."""


def draw_names(axes: Axes, town: TrueTown) -> None:
    """Write the name of each building within it, and that of each street along it, where they fit.

    The map must be arranged.
    """
    taken = []
    for building in town.buildings:
        box = _name_building(axes, building)
        if box is not None:
            taken.append(box)

    for street in sorted(town.streets, key=_longest_m, reverse=True):
        box = _name_street(axes, street, taken)
        if box is not None:
            taken.append(box)


def labels_of(axes: Axes, marked: Iterable[tuple[str, tuple[float, float]]]) -> list[Label]:
    """Return labels for places that are marked, by name, above their markers; places that are one
    share a label. The map must be arranged.
    """
    names: dict[tuple[float, float], list[str]] = {}
    for name, (x_m, y_m) in marked:
        names.setdefault((round(x_m), round(y_m)), []).append(name)

    above_m = ABOVE_PT * m_per_pt(axes)
    return [
        Label(", ".join(shared), x_m, y_m + above_m, INK) for (x_m, y_m), shared in names.items()
    ]


def _name_building(axes: Axes, building: Building) -> Bbox | None:
    """Write the name of a building above its lower side, in one line or in several; returns the box
    that it takes, None if it does not fit.
    """
    width_m, height_m = _room_m(building)
    if height_m < SIZES_PT[-1] * m_per_pt(axes):
        return None  # of the thousands of a city nothing is measured

    lower_m = building.pose.y_m - height_m / 2
    px = px_per_m(axes)
    name = spoken(building.name)
    text = _text(axes, (building.pose.x_m, lower_m), {"va": "bottom", "ha": "center"})
    for size_pt in SIZES_PT:
        for written in dict.fromkeys((name, name.replace(" ", "\n"))):
            text.set(text=written, fontsize=size_pt)
            box = text.get_window_extent()
            if box.width <= width_m * px and box.height <= height_m * px:
                return box

    text.remove()
    return None


def _room_m(building: Building) -> tuple[float, float]:
    """Return how wide and how high a name within a building may be."""
    width_m, depth_m = building.width_m, building.depth_m
    off_rad = math.remainder(building.pose.heading_rad, math.pi / 2)
    if abs(off_rad) > LEVEL_RAD:
        side_m = min(width_m, depth_m) / math.sqrt(2)
        return side_m, side_m

    is_along_y = abs(math.sin(building.pose.heading_rad)) > 0.5
    return (depth_m, width_m) if is_along_y else (width_m, depth_m)


def _name_street(axes: Axes, street: Street, taken: Iterable[Bbox]) -> Bbox | None:
    """Write the name of a street beside the middle of its longest piece; returns the box that it
    takes, None if it does not fit or would hide another name.
    """
    line_m = np.array(street.line_m)
    longest = int(np.hypot(*np.diff(line_m, axis=0).T).argmax())
    start_m, end_m = line_m[longest], line_m[longest + 1]
    along_x_m, along_y_m = (end_m - start_m).tolist()
    length_m = math.hypot(along_x_m, along_y_m)

    # From left to right, or upwards.
    turn_rad = math.atan2(along_y_m, along_x_m)
    if not LEVEL_RAD - math.pi / 2 < turn_rad <= LEVEL_RAD + math.pi / 2:
        turn_rad = math.remainder(turn_rad + math.pi, math.tau)

    aside_m = street.width_m / 4 * np.array([-math.sin(turn_rad), math.cos(turn_rad)])
    x_m, y_m = ((start_m + end_m) / 2 + aside_m).tolist()
    text = _text(axes, (x_m, y_m), {"va": "center", "ha": "center", "rotation_mode": "anchor"})
    text.set(text=street.name, fontsize=SIZES_PT[0])
    fits = text.get_window_extent().width <= length_m * px_per_m(axes)
    text.set_rotation(math.degrees(turn_rad))
    box = text.get_window_extent()
    if fits and not any(box.overlaps(other) for other in taken):
        return box

    text.remove()
    return None


def _longest_m(street: Street) -> float:
    """Return the length of the longest straight piece of a street."""
    return float(np.hypot(*np.diff(np.array(street.line_m), axis=0).T).max())


def _text(axes: Axes, at_m: tuple[float, float], style: dict[str, Any]) -> Text:
    halo = [outlines.withStroke(linewidth=2.0, foreground=PAPER, alpha=0.85)]
    text = axes.text(*at_m, "", color=INK, zorder=ORDER, linespacing=0.95, **style)
    text.set(path_effects=halo, clip_on=True)
    return text
