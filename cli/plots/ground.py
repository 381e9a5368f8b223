"""The ground in front of the robot: the road as it lies in the image, and the plan from above."""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.patches import Circle, Ellipse, Polygon

from cogmap.cli.plots.draw import colours_of, spoken
from cogmap.cli.plots.labels import Label, place
from cogmap.cli.plots.palette import ESTIMATE, INK, KERB, ROAD, ROAD_OPACITY, STREET
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Calibration, Percept, Percepts
from cogmap.services.epam.layout.ground import CELL_M

Floats = npt.NDArray[np.float64]
NEAREST_M = 0.4
MIN_AHEAD_M = 18.0
MARGIN_M = 3.0
RING_M = 10.0
MAX_ABOVE_M = 2.0
ROBOT_PER_M = 40.0
# Longer ellipses are fainter: they cover much of the plan.
FAINTER_M = 12.0
FINER = 4
_SHIFT = 4


def points(array: Array) -> Floats:
    """Return ground points (n, 2), none if the array holds something else."""
    fits = len(array.shape) == 2 and array.shape[1] == 2
    return array.numpy().astype(np.float64) if fits else np.empty((0, 2))


def cells(road_m: Floats) -> Floats:
    """Return the corners (n, 4, 2) of the ground cells that `road_m` fall into."""
    corner = np.floor(road_m / CELL_M)[:, None] * CELL_M
    return np.asarray(corner + CELL_M * np.array([(0, 0), (1, 0), (1, 1), (0, 1)]))


def to_image(ground_m: Floats, camera: Calibration) -> Floats:
    """Compute column and row (n, 2) of ground points (n, 2), as a level camera sees them; nearer
    than NEAREST_M as if at that distance.
    """
    ahead_m = np.maximum(ground_m[:, 0] - camera.mount_forward_m, NEAREST_M)
    column = camera.cx_px - camera.fx_px * ground_m[:, 1] / ahead_m
    return np.stack([column, camera.cy_px + camera.fy_px * camera.mount_height_m / ahead_m], axis=1)


def draw_road_in_image(axes: Axes, percepts: Percepts, camera: Calibration) -> None:
    """Draw the road's cells over the image, and points where it ends."""
    size = (FINER * camera.height_px, FINER * camera.width_px)
    mask = np.zeros(size, np.uint8)
    corners = cells(points(percepts.road_m)).reshape(-1, 2)
    pixels = (to_image(corners, camera) + 0.5) * FINER - 0.5
    for patch in np.round(pixels * 2**_SHIFT).astype(np.int32).reshape(-1, 4, 2):
        cv2.fillConvexPoly(mask, patch, 1, shift=_SHIFT)
    layer = np.zeros((*size, 4))
    layer[..., :3], layer[..., 3] = to_rgb(ROAD), ROAD_OPACITY * mask
    extent = (-0.5, camera.width_px - 0.5, camera.height_px - 0.5, -0.5)
    axes.imshow(layer, extent=extent, interpolation="antialiased", zorder=5)
    ends = to_image(points(percepts.road_boundary_m), camera)
    axes.plot(*ends.T, "o", ms=3, mfc=ESTIMATE, mec="white", mew=0.5, zorder=6)
    axes.set_xlim(extent[:2])
    axes.set_ylim(extent[2:])


def draw_plan(axes: Axes, percepts: Percepts, camera: Calibration) -> None:
    """Draw the road, where it ends, and objects with twice their standard deviations, from above,
    the robot looking up.
    """
    farthest_m = _farthest_m(percepts)
    far_m = 3 * farthest_m
    edges = [(camera.cx_px - column) / camera.fx_px for column in (0, camera.width_px - 1)]
    field = np.array([(0.0, 0.0), *((far_m, far_m * edge) for edge in edges)])
    field[:, 0] += camera.mount_forward_m
    axes.add_patch(
        Polygon(_from_above(field), closed=True, fc=STREET, alpha=0.45, ec="none", zorder=0)
    )
    for number in range(1, math.ceil(1.5 * farthest_m / RING_M)):
        axes.add_patch(
            Circle((0, 0), number * RING_M, fill=False, ec=KERB, lw=0.7, ls=(0, (3, 3)), zorder=1)
        )
    for patch in cells(points(percepts.road_m)):
        axes.add_patch(
            Polygon(
                _from_above(patch), closed=True, fc=ROAD, alpha=ROAD_OPACITY, ec="none", zorder=3
            )
        )
    ends = _from_above(points(percepts.road_boundary_m))
    axes.plot(*ends.T, "o", ms=2.6, mfc=ESTIMATE, mec="white", mew=0.4, zorder=4)
    for percept, colour in zip(percepts.objects, colours_of(percepts.objects), strict=True):
        middle = _from_above(_position_m(percept)[None])[0]
        across_m = 4 * percept.range_m * percept.bearing_sd_rad
        along_m = 4 * percept.range_sd_m
        turn = math.degrees(percept.bearing_rad)
        axes.plot([0, middle[0]], [0, middle[1]], color=colour, lw=0.7, alpha=0.55, zorder=2)
        opacity = 0.25 * FAINTER_M / max(along_m, FAINTER_M)
        axes.add_patch(
            Ellipse(
                middle.tolist(),
                across_m,
                along_m,
                angle=turn,
                fc=to_rgba(colour, opacity),
                ec=colour,
                lw=1.2,
                zorder=6,
            )
        )
        axes.plot(*middle, "o", ms=5, mfc=colour, mec="white", mew=0.8, zorder=7)
    robot = np.array([(1.1, 0.0), (-0.7, 0.7), (-0.3, 0.0), (-0.7, -0.7)]) * max(
        1.0, farthest_m / ROBOT_PER_M
    )
    axes.add_patch(Polygon(_from_above(robot), closed=True, fc=INK, ec="white", lw=0.8, zorder=8))


def fit_plan(axes: Axes, percepts: Percepts) -> None:
    """Set limits that hold all, a metre as long across as ahead. The layout must be settled."""
    sides_m = [
        2 * abs(float(_position_m(percept)[1])) + 2 * MARGIN_M for percept in percepts.objects
    ]
    box = axes.get_window_extent()
    ahead_m = max(
        _farthest_m(percepts) + MARGIN_M, max(sides_m, default=0.0) * box.height / box.width
    )
    half_m = ahead_m * box.width / box.height / 2
    axes.set(xlim=(-half_m, half_m), ylim=(-MARGIN_M, ahead_m - MARGIN_M))


def name_in_plan(axes: Axes, objects: list[Percept], size: float) -> None:
    """Write the names of the objects in the plan. Layout and limits must be settled."""
    labels = []
    for percept, colour in zip(objects, colours_of(objects), strict=True):
        if not percept.name:
            continue

        x, y = _from_above(_position_m(percept)[None])[0].tolist()
        labels.append(
            Label(spoken(percept.name), x, y + min(2 * percept.range_sd_m, MAX_ABOVE_M), colour)
        )
    place(axes, labels, size)


def _position_m(percept: Percept) -> Floats:
    return percept.range_m * np.array(
        [math.cos(percept.bearing_rad), math.sin(percept.bearing_rad)]
    )


def _from_above(robot_m: Floats) -> Floats:
    """Turn points in the robot's frame (n, 2) into those to draw: rightwards, then forwards."""
    return np.stack([-robot_m[:, 1], robot_m[:, 0]], axis=1)


def _farthest_m(percepts: Percepts) -> float:
    road_m: list[float] = points(percepts.road_m)[:, 0].tolist()
    objects_m = [float(_position_m(percept)[0]) for percept in percepts.objects]
    return max([*road_m, *objects_m, MIN_AHEAD_M]) + MARGIN_M
