"""A range scan on the local grid: what its rays hit, and which cells they pass through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import rotate
from schemas.array import Array
from services.codelets.mapping.local_grid import LocalGrid

STEP = 0.5
MIN_WIDTH_M = 0.3
MAX_GAP_M = 1.0
MAX_GAP_SHARE = 0.05
# So many points of the road, so far behind what a ray hits, show that nothing stands there.
BEYOND_M = 1.0
MIN_BEYOND = 2
MIN_RAYS = 2


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
        """(k, 2): where something stands."""
        ends: Floats = self.eye + self.length[:, None] * self.directions
        return ends[self.is_hit]


def rays_of(
    scan: Array | None, road_m: Array, grid: LocalGrid, reach_m: float, range_sd_share: float
) -> Rays:
    """The rays of a task's scan on `grid`; none where there is no scan. Those that hit something
    before road that is seen, `road_m` (n, 2), are left out: nothing stands there.

    A ray is clear up to half a cell, and twice the standard deviation, before what it hits. One
    that saw nothing at all, which may be the fault of the sensor, is clear for half the reach.
    """
    rays = np.zeros((0, 2)) if scan is None else np.asarray(scan.numpy(), np.float64)
    rays = _before_road(rays.reshape(-1, 2), np.asarray(road_m.numpy(), np.float64))
    bearing_rad, range_m = rays.T
    has_seen = range_m > 0

    before_hit_m = range_m * (1 - 2 * range_sd_share) - grid.cell_m / 2
    clear_m = np.where(has_seen, before_hit_m, reach_m / 2).clip(0.0, reach_m)

    ahead = np.column_stack([np.cos(bearing_rad), np.sin(bearing_rad)])
    between_rad = np.abs(np.diff(bearing_rad))
    return Rays(
        eye=grid.pose[:2] / grid.cell_m,
        directions=rotate(ahead, grid.pose[2]),
        length=range_m / grid.cell_m,
        is_hit=has_seen & (range_m <= reach_m),
        clear=clear_m / grid.cell_m,
        angle_rad=float(np.median(between_rad)) if len(between_rad) else 0.0,
    )


def _before_road(rays: Floats, road_m: Floats) -> Floats:
    """(k, 2): the rays, bearing and range each, beyond whose hit no road is seen in their sector.

    Of two senses that contradict each other the eye for the road is the better one: where stereo
    finds an obstacle by a wrong match, the road goes on behind it.
    """
    if len(rays) < MIN_RAYS:
        return rays

    order = np.argsort(rays[:, 0])
    bearing_rad, range_m = rays[order].T
    borders_rad = (bearing_rad[1:] + bearing_rad[:-1]) / 2
    road_rad = np.arctan2(road_m[:, 1], road_m[:, 0])
    sector = np.searchsorted(borders_rad, road_rad)

    beyond_m = np.hypot(road_m[:, 0], road_m[:, 1]) - range_m[sector]
    seen = np.bincount(sector[beyond_m > BEYOND_M], minlength=len(rays))
    is_kept = np.ones(len(rays), bool)
    is_kept[order] = (range_m == 0) | (seen < MIN_BEYOND)
    return rays[is_kept]


def clear_cells(rays: Rays, grid: LocalGrid) -> Booleans:
    """(w, h): the cells that rays pass through and in which they hit nothing."""
    longest = np.max(rays.clear, initial=0.0)
    along = np.arange(0.0, longest, STEP)
    is_clear = along < rays.clear[:, None]

    passed = rays.eye + along[:, None] * rays.directions[:, None, :]
    is_passed = grid.counts(passed[is_clear]) > 0
    has_hit = grid.counts(rays.hits()) > 0
    return is_passed & ~has_hit


def walls(rays: Rays, cell_m: float) -> tuple[Floats, Floats]:
    """What was hit, as straight segments from (k, 2) to (k, 2).

    Each hit stands across its ray, as wide as the ray is there; hits of successive rays that are
    near each other are joined, for a wall that runs away from the agent.
    """
    across = rotate(rays.directions, np.pi / 2)[rays.is_hit]
    length = rays.length[rays.is_hit]
    half = np.maximum(rays.angle_rad * length, MIN_WIDTH_M / cell_m) / 2

    hits = rays.hits()
    aside = half[:, None] * across
    number = np.flatnonzero(rays.is_hit)
    gap = np.hypot(*np.diff(hits, axis=0).T)

    max_gap = MAX_GAP_M / cell_m + MAX_GAP_SHARE * length[1:]
    is_joined = (np.diff(number) == 1) & (gap <= max_gap)
    starts = np.concatenate([hits - aside, hits[:-1][is_joined]])
    ends = np.concatenate([hits + aside, hits[1:][is_joined]])
    return starts, ends
