"""The town as it is, as the lowest layer of the map."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle
from matplotlib.transforms import Affine2D

from cogmap.cli.plots.map.markers import CHARGING_MARKER
from cogmap.cli.plots.palette import CLOSED, DISTRICTS, HOUSE, KERB, STREET, WALL
from cogmap.schemas.sensing import Building, Obstacle, Street, TrueTown
from cogmap.services.sim.layout.furniture import CHARGING_PLACE

Handle = Patch | Line2D
"""A sample in a legend."""

Points = npt.NDArray[np.float64]


def draw_town(axes: Axes, town: TrueTown) -> list[Handle]:
    """Draw streets, obstacles, buildings (those of a district in one tint), and what is closed.
    Returns the legend of what there is.
    """
    for wider_m, colour, order in ((1.0, KERB, 1.0), (0.0, STREET, 1.1)):
        for street in town.streets:
            line_m = np.array(street.line_m)
            for start_m, end_m in pairwise(line_m):
                _draw_band(axes, (start_m, end_m), street.width_m + wider_m, colour, order)

    for obstacle in town.obstacles:
        _draw_obstacle(axes, obstacle)

    tints = _tints(town)
    for building in town.buildings:
        _draw_building(axes, building, tints[building.district])

    for street in town.streets:
        if street.closed:
            _draw_barrier(axes, street)

    return [*_legend_of_streets(town), *_legend_of_buildings(tints), *_legend_of_obstacles(town)]


def _tints(town: TrueTown) -> dict[str, str]:
    """Choose the colour of each district's buildings, and of those in none."""
    named = sorted({building.district for building in town.buildings})
    tints = {"": HOUSE} if "" in named else {}
    for number, district in enumerate(name for name in named if name):
        tints[district] = DISTRICTS[number % len(DISTRICTS)]

    return tints


def _legend_of_streets(town: TrueTown) -> list[Handle]:
    handles: list[Handle] = []
    if town.streets:
        handles.append(Patch(fc=STREET, ec=KERB, label="street"))
    if any(street.closed for street in town.streets):
        handles.append(Line2D([], [], color=CLOSED, lw=3, label="barrier: the street is closed"))

    return handles


def _legend_of_buildings(tints: dict[str, str]) -> list[Handle]:
    handles: list[Handle] = []
    for district, tint in tints.items():
        name = f"building of {district}" if district else "building"
        handles.append(Patch(fc=tint, ec=WALL, label=name))

    return handles


def _legend_of_obstacles(town: TrueTown) -> list[Handle]:
    handles: list[Handle] = []
    kinds = {obstacle.kind for obstacle in town.obstacles}
    if kinds - {CHARGING_PLACE}:
        handles.append(Patch(fc=WALL, label="tree, car and the like"))
    if CHARGING_PLACE in kinds:
        handles.append(Line2D([], [], label="charging place", **CHARGING_MARKER))

    return handles


def _draw_band(
    axes: Axes, ends_m: tuple[Points, Points], width_m: float, colour: str, order: float
) -> None:
    """Draw a stretch of street; its ends reach half a width further, so that corners close."""
    start_m, end_m = ends_m
    along_m = end_m - start_m
    length_m = float(np.hypot(*along_m)) + width_m
    heading_rad = math.atan2(along_m[1], along_m[0])

    middle_m = (start_m + end_m) / 2
    size_m = (length_m, width_m)
    _draw_box(axes, middle_m, size_m, heading_rad, {"facecolor": colour, "zorder": order})


def _draw_box(
    axes: Axes,
    middle_m: npt.ArrayLike,
    size_m: tuple[float, float],
    heading_rad: float,
    style: dict[str, Any],
) -> None:
    """Draw a rectangle; `size_m` is its size along its heading, and across it."""
    x_m, y_m = np.asarray(middle_m, float).tolist()
    length_m, width_m = size_m
    turned = Affine2D().rotate(heading_rad).translate(x_m, y_m) + axes.transData

    corner_m = (-length_m / 2, -width_m / 2)
    box = Rectangle(corner_m, length_m, width_m, transform=turned, **style)
    axes.add_patch(box)


def _draw_obstacle(axes: Axes, obstacle: Obstacle) -> None:
    pose = obstacle.pose
    if obstacle.kind == CHARGING_PLACE:
        axes.plot(pose.x_m, pose.y_m, zorder=6, **CHARGING_MARKER)
        return

    style: dict[str, Any] = {"facecolor": WALL, "zorder": 1.5}
    size_m = (obstacle.length_m, obstacle.width_m)
    _draw_box(axes, (pose.x_m, pose.y_m), size_m, pose.heading_rad, style)


def _draw_building(axes: Axes, building: Building, colour: str) -> None:
    pose = building.pose
    style: dict[str, Any] = {
        "facecolor": colour,
        "edgecolor": WALL,
        "linewidth": 0.8,
        "zorder": 2,
    }
    if building.outline_m:
        axes.add_patch(Polygon(building.outline_m, **style))
        return

    size_m = (building.width_m, building.depth_m)
    _draw_box(axes, (pose.x_m, pose.y_m), size_m, pose.heading_rad, style)


def _draw_barrier(axes: Axes, street: Street) -> None:
    """Draw a bar across the middle of a street."""
    start_m, end_m = np.array(street.line_m)[[0, -1]]
    along_m = end_m - start_m
    across_rad = math.atan2(along_m[0], -along_m[1])

    middle_m = (start_m + end_m) / 2
    size_m = (street.width_m + 4.0, 1.2)
    _draw_box(axes, middle_m, size_m, across_rad, {"facecolor": CLOSED, "zorder": 7})
