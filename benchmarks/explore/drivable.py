"""Where a robot can drive in a town as it was built, and the length of the shortest route there."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.robot import HALF_WIDTH_M
from cogmap.schemas.sensing import Street, TrueTown

CELL_M = 0.5
MARGIN_M = 5.0
BARRIER_M = 1.0
MOVES = ((1, 0), (1, 1), (0, 1), (-1, 1), (2, 1), (1, 2), (-1, 2), (-2, 1))
"""Half of the moves on the grid: with the knight's of chess, a length is 2.7 % too long at most."""


class Drivable(NamedTuple):
    """Cells of CELL_M that the robot's centre may be on: `is_free` (w, h), from `corner_m`."""

    corner_m: Floats
    is_free: Booleans

    @classmethod
    def of(cls, town: TrueTown) -> Drivable:
        """Draw a town's streets without its obstacles, and with barriers across closed ones."""
        points_m = np.vstack([np.array(street.line_m, float) for street in town.streets])
        corner_m = points_m.min(axis=0) - MARGIN_M
        extent_m = np.ptp(points_m, axis=0) + 2 * MARGIN_M
        canvas = np.zeros(np.ceil(extent_m / CELL_M).astype(int).tolist(), np.uint8)

        # The ends of a street are round.
        for street in town.streets:
            points = [_pixel(point, corner_m) for point in street.line_m]
            width = max(1, round(street.width_m / CELL_M))
            for start, end in pairwise(points):
                cv2.line(canvas, start, end, 1, width)

        for obstacle in town.obstacles:
            pose = obstacle.pose
            centre = _pixel((pose.x_m, pose.y_m), corner_m)
            size = (obstacle.width_m / CELL_M, obstacle.length_m / CELL_M)
            corners = cv2.boxPoints((centre, size, -float(np.degrees(pose.heading_rad))))
            cv2.fillConvexPoly(canvas, np.rint(corners).astype(np.int32), 0)

        for street in town.streets:
            if street.closed:
                first, last = (_pixel(end_m.tolist(), corner_m) for end_m in barrier_m(street))
                cv2.line(canvas, first, last, 0, round(BARRIER_M / CELL_M))

        width = 2 * round(HALF_WIDTH_M / CELL_M) + 1
        robot = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width))
        is_free = cv2.erode(canvas, robot) > 0
        return cls(corner_m, np.asarray(is_free))

    def cell(self, x_m: float, y_m: float) -> int:
        """Return the number of the free cell nearest to a position."""
        cells = np.argwhere(self.is_free)
        centres_m = self.corner_m + cells * CELL_M
        away_m = np.hypot(*(centres_m - (x_m, y_m)).T)

        i, j = cells[away_m.argmin()].tolist()
        _, height = self.is_free.shape
        return int(i * height + j)

    def is_on(self, x_m: float, y_m: float) -> bool:
        """Decide whether the robot's centre may be at a position."""
        j, i = _pixel((x_m, y_m), self.corner_m)
        width, height = self.is_free.shape
        is_inside = 0 <= i < width and 0 <= j < height
        return is_inside and bool(self.is_free[i, j])

    def lengths_from(self, x_m: float, y_m: float) -> Floats:
        """Return the (w, h) shortest routes' lengths from a position, infinite if none leads."""
        start = self.cell(x_m, y_m)
        links = _links(self.is_free)
        lengths_m = np.asarray(dijkstra(links, indices=start), np.float64)
        return lengths_m.reshape(self.is_free.shape)

    def route_m(self, start_m: tuple[float, float], end_m: tuple[float, float]) -> Floats:
        """Find the (n, 2) shortest route between two positions; there must be one."""
        links = _links(self.is_free)
        start = self.cell(*start_m)
        _, before = dijkstra(links, indices=start, return_predecessors=True)

        numbers = [self.cell(*end_m)]
        while numbers[-1] != start:
            numbers.append(int(before[numbers[-1]]))

        _, height = self.is_free.shape
        cells = np.column_stack(np.divmod(numbers[::-1], height))
        positions_m: Floats = self.corner_m + cells * CELL_M
        return positions_m

    def length_m(self, start_m: tuple[float, float], end_m: tuple[float, float]) -> float:
        """Return the length of the shortest route between two positions; infinite without one."""
        lengths_m = self.lengths_from(*start_m)
        return float(lengths_m.ravel()[self.cell(*end_m)])


def barrier_m(street: Street) -> Floats:
    """Return the (2, 2) ends, beyond the kerbs, of the barrier that closes a street's middle."""
    start_m = np.array(street.line_m[0])
    end_m = np.array(street.line_m[-1])
    middle_m = (start_m + end_m) / 2

    ahead_x_m, ahead_y_m = end_m - start_m
    length_m = np.hypot(ahead_x_m, ahead_y_m)
    left = np.array([-ahead_y_m, ahead_x_m]) / length_m
    across_m = left * (street.width_m + MARGIN_M) / 2
    return np.stack([middle_m - across_m, middle_m + across_m])


def _pixel(point_m: Iterable[float], corner_m: Floats) -> tuple[int, int]:
    """Return a position as OpenCV takes it: the second index first."""
    x_m, y_m = point_m
    offset_m = np.array([x_m, y_m]) - corner_m
    cell = np.rint(offset_m / CELL_M)

    i, j = cell.astype(int).tolist()
    return j, i


def _links(is_free: Booleans) -> sparse.csr_matrix:
    """Return the (n, n) lengths of the moves between free cells."""
    number = np.arange(is_free.size).reshape(is_free.shape)
    rows: list[Indices] = []
    columns: list[Indices] = []
    lengths: list[Floats] = []
    width, height = is_free.shape
    for di, dj in MOVES:
        west = max(0, -di)
        east = max(0, di)
        here = (slice(west, width - east), slice(0, height - dj))
        there = (slice(east, width - west), slice(dj, height))

        are_both_free = is_free[here] & is_free[there]
        rows.append(number[here][are_both_free])
        columns.append(number[there][are_both_free])
        lengths.append(np.full(np.count_nonzero(are_both_free), CELL_M * np.hypot(di, dj)))

    entries = np.concatenate(lengths)
    places = (np.concatenate(rows), np.concatenate(columns))
    one_way = sparse.csr_matrix((entries, places), shape=(is_free.size, is_free.size))
    return one_way + one_way.T
