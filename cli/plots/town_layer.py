"""The town as it is, as the lowest layer of the map."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import matplotlib.patheffects as outlines
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Polygon, Rectangle
from matplotlib.transforms import Affine2D

from cogmap.cli.plots.palette import CHARGING, CLOSED, HOUSE, KERB, NAME, SEVERAL, STREET, WALL
from cogmap.schemas.sensing import Building, Obstacle, Street, TrueTown
from cogmap.services.sim.layout.furniture import CHARGING_PLACE

# A plus, filled.
CHARGING_MARKER: dict[str, Any] = {"marker": "P", "ms": 9, "ls": "", "color": CHARGING}
Colour = tuple[float, float, float]
Points = npt.NDArray[np.float64]

DISTRICT_SHARE = 0.3
# Names of more buildings than that would hide the map.
MAX_NAMES = 40


def draw_town(axes: Axes, town: TrueTown) -> None:
    """Draw streets, obstacles, buildings (those of a district in one tint), and what is closed."""
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

    if len(town.buildings) <= MAX_NAMES:
        for building in town.buildings:
            _draw_name(axes, building)

    for street in town.streets:
        if street.closed:
            _draw_barrier(axes, street)


def _tints(town: TrueTown) -> dict[str, Colour]:
    """Choose the colour of each district's buildings."""
    tints: dict[str, Colour] = {"": to_rgb(HOUSE)}
    districts = {building.district for building in town.buildings} - {""}
    for number, district in enumerate(sorted(districts)):
        colour = SEVERAL[number % len(SEVERAL)]
        house, tint = np.array(to_rgb(HOUSE)), np.array(to_rgb(colour))
        levels = (1 - DISTRICT_SHARE) * house + DISTRICT_SHARE * tint
        red, green, blue = levels.tolist()
        tints[district] = red, green, blue

    return tints


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


def _draw_building(axes: Axes, building: Building, colour: Colour) -> None:
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


def _draw_name(axes: Axes, building: Building) -> None:
    """Write a building's name along its lower side."""
    pose = building.pose
    by_width_m = abs(building.width_m * math.sin(pose.heading_rad))
    by_depth_m = abs(building.depth_m * math.cos(pose.heading_rad))
    lower_m = pose.y_m - (by_width_m + by_depth_m) / 2

    shown = building.name.replace("_", " ")
    name = axes.text(
        pose.x_m, lower_m + 0.6, shown, ha="center", va="bottom", fontsize=6.5, color=NAME
    )
    name.set(zorder=6, path_effects=[outlines.withStroke(linewidth=1.8, foreground=HOUSE)])


def _draw_barrier(axes: Axes, street: Street) -> None:
    """Draw a bar across the middle of a street."""
    start_m, end_m = np.array(street.line_m)[[0, -1]]
    along_m = end_m - start_m
    across_rad = math.atan2(along_m[0], -along_m[1])

    middle_m = (start_m + end_m) / 2
    size_m = (street.width_m + 4.0, 1.2)
    _draw_box(axes, middle_m, size_m, across_rad, {"facecolor": CLOSED, "zorder": 7})
