"""A range scan on the local grid: what its rays hit, and which cells they pass through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import rotate
from cogmap.schemas.array import Array
from cogmap.services.codelets.mapping.local_grid import RANGE_SD_SHARE, LocalGrid

# In cells: two points a cell miss none that a ray passes by more than a corner.
STEP = 0.5
# What a ray hits is taken to be at least so wide.
MIN_WIDTH_M = 0.3
# Farther away a ray that grazes a wall may seem to pass through it.
CLEAR_M = 15.0
# Hits of successive rays are of one wall if no more than this and a share of the range apart.
MAX_GAP_M = 1.0
MAX_GAP_SHARE = 0.05
# So many points of the road, so far behind what a ray hits, show that nothing stands there.
BEYOND_M = 1.0
MIN_BEYOND = 2


@dataclass(frozen=True, eq=False)
class Rays:
    """n rays from `eye` (2,) in `directions` (n, 2), of length 1. Lengths are in cells.

    Something stands at `length` (n,) where `is_hit` (n,). Each is clear up to `clear` (n,).
    `angle_rad` is that between successive rays.
    """

    eye: Floats
    directions: Floats
    length: Floats
    is_hit: Booleans
    clear: Floats
    angle_rad: float

    def hits(self) -> Floats:
        """Return where something stands, (k, 2)."""
        lengths = self.length[self.is_hit]
        along = lengths[:, None] * self.directions[self.is_hit]
        ends: Floats = self.eye + along
        return ends


def rays_of(scan: Array | None, road_m: Floats, grid: LocalGrid) -> Rays:
    """Return the rays of a task's scan on `grid`; none without a scan. Leave out those that hit
    something in front of road that is seen, `road_m` (n, 2): nothing stands there.

    A ray is clear up to half a cell, and twice the standard deviation, before what it hits. One
    that saw nothing at all, which may be the fault of the sensor, is clear for half the reach.
    """
    rays = np.zeros((0, 2)) if scan is None else np.asarray(scan.numpy(), np.float64)
    angle_rad = float(np.median(np.abs(np.diff(rays[:, 0])))) if len(rays) > 1 else 0.0
    bearing_rad, range_m = _before_road(rays, road_m).T
    has_seen = range_m > 0

    before_hit_m = range_m * (1 - 2 * RANGE_SD_SHARE) - grid.cell_m / 2
    clear_m = np.where(has_seen, before_hit_m, grid.reach_m / 2)

    ahead = np.column_stack([np.cos(bearing_rad), np.sin(bearing_rad)])
    return Rays(
        eye=grid.eye,
        directions=rotate(ahead, grid.pose[2]),
        length=range_m / grid.cell_m,
        is_hit=has_seen & (range_m <= grid.reach_m),
        clear=clear_m.clip(0.0, min(grid.reach_m, CLEAR_M)) / grid.cell_m,
        angle_rad=angle_rad,
    )


def _before_road(rays: Floats, road_m: Floats) -> Floats:
    """Choose the (k, 2) rays, bearing and range, beyond whose hit their sector shows no road.

    If the two senses contradict each other, that for the road is the better one: behind an obstacle
    that stereo finds by a wrong match, the road continues.
    """
    if not len(rays):
        return rays

    order = np.argsort(rays[:, 0])
    bearing_rad, range_m = rays[order].T
    borders_rad = (bearing_rad[1:] + bearing_rad[:-1]) / 2
    sector = borders_rad.searchsorted(np.arctan2(road_m[:, 1], road_m[:, 0]))
    beyond_m = np.hypot(road_m[:, 0], road_m[:, 1]) - range_m[sector]

    number_beyond = np.bincount(sector[beyond_m > BEYOND_M], minlength=len(rays))
    saw_nothing = range_m == 0
    is_kept = np.ones(len(rays), bool)
    is_kept[order] = saw_nothing | (number_beyond < MIN_BEYOND)
    return rays[is_kept]


def clear_cells(rays: Rays, grid: LocalGrid) -> Booleans:
    """Find the cells that rays pass through and in which they hit nothing, (w, h)."""
    farthest = np.max(rays.clear, initial=0.0)
    along = np.arange(0.0, farthest, STEP)
    is_clear = along < rays.clear[:, None]

    steps = along[:, None] * rays.directions[:, None, :]
    passed = rays.eye + steps[is_clear]
    return grid.has(passed) & ~grid.has(rays.hits())


def walls(rays: Rays, cell_m: float) -> tuple[Floats, Floats]:
    """Return what was hit, as straight segments from (k, 2) to (k, 2).

    Each hit stands across its ray, as wide as the ray is there; hits of successive rays that are
    near each other are joined, for a wall that runs away from the agent.
    """
    hits = rays.hits()
    number = np.flatnonzero(rays.is_hit)
    length = rays.length[number]
    across = rotate(rays.directions[number], np.pi / 2)
    width = np.maximum(rays.angle_rad * length, MIN_WIDTH_M / cell_m)
    aside = width[:, None] / 2 * across

    are_successive = np.diff(number) == 1
    gap = np.hypot(*np.diff(hits, axis=0).T)
    is_joined = are_successive & (gap <= MAX_GAP_M / cell_m + MAX_GAP_SHARE * length[1:])

    starts = np.concatenate([hits - aside, hits[:-1][is_joined]])
    ends = np.concatenate([hits + aside, hits[1:][is_joined]])
    return starts, ends
