"""Which streets and buildings of a town touch, and what lies on a street. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from cogmap.services.sim.layout.plan import Plot, Point, Road

Box = tuple[Point, Point, float]
"""A turned rectangle as OpenCV has it: its middle, its size, and its heading in degrees."""


def of_road(road: Road, reach_m: float = 0.0) -> Box:
    """Return the surface of a road, and what lies within `reach_m` of it."""
    # Its ends reach half a width further, so that corners close.
    length_m = road.length_m + road.width_m + 2 * reach_m
    width_m = road.width_m + 2 * reach_m
    return road.middle, (length_m, width_m), math.degrees(road.heading_rad)


def of_plot(plot: Plot) -> Box:
    """Return the footprint of a building that is a rectangle."""
    size_m = (plot.kind.width_m, plot.kind.depth_m)
    return (plot.x_m, plot.y_m), size_m, math.degrees(plot.heading_rad)


def meet(a: Box, b: Box) -> bool:
    """Decide whether two rectangles overlap."""
    kind, _ = cv2.rotatedRectangleIntersection(a, b)
    return bool(kind != cv2.INTERSECT_NONE)


def holds(box: Box, point_m: Point) -> bool:
    """Decide whether a rectangle holds a point."""
    corners_m = cv2.boxPoints(box)
    return cv2.pointPolygonTest(corners_m, point_m, measureDist=False) >= 0


def apart(streets: Sequence[Sequence[Box]]) -> list[int]:
    """Return the numbers of the streets, each of some surfaces, that no way along others leads to
    from the first one.
    """
    reached = {0}
    waiting = [0]
    while waiting:
        here = waiting.pop()
        for number, street in enumerate(streets):
            if number not in reached and _any_meet(streets[here], street):
                reached.add(number)
                waiting.append(number)

    return [number for number in range(len(streets)) if number not in reached]


def _any_meet(street: Sequence[Box], other: Sequence[Box]) -> bool:
    """Decide whether any surface of one street touches one of the other."""
    return any(meet(a, b) for a in street for b in other)


def first_meeting(boxes: Sequence[Box], others: Sequence[Box]) -> tuple[int, int] | None:
    """Return the numbers of a box and of one of the others that it overlaps, the first there is."""
    if not boxes or not others:
        return None

    reach = np.array([math.hypot(*size) / 2 for _, size, _ in others])
    middles = np.array([middle for middle, _, _ in others])
    for number, box in enumerate(boxes):
        middle, size, _ = box
        away = np.hypot(*(middles - middle).T)
        near = np.flatnonzero(away <= reach + math.hypot(*size) / 2).tolist()
        for other in near:
            if box is not others[other] and meet(box, others[other]):
                return number, other

    return None
