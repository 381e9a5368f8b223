"""Where the ground ends that can be driven on, and the links that this cuts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.graph.crossings import crossings
from cogmap.graph.window import LINK_OFFSETS
from cogmap.services.codelets.mapping.local_grid import LocalGrid
from cogmap.services.codelets.mapping.rays import Rays, walls

# Perception has a point of the boundary in each 0.5 m: in two such cells side by side, points are
# at most 1.12 m apart.
JOIN_M = 1.2


class Edges(NamedTuple):
    """Straight segments, (k, 2) each, in cells."""

    starts: Floats
    ends: Floats

    def middles(self) -> Floats:
        """Compute the middle of each, (k, 2)."""
        return (self.starts + self.ends) / 2


def edges_of(boundary_m: Floats, rays: Rays, grid: LocalGrid) -> Edges:
    """Return where the road ends, by (n, 2) points in the robot's frame, and what rays hit.

    Each two points within reach that are at most JOIN_M apart are joined; a point alone is taken
    for a mistake.
    """
    range_m = np.hypot(boundary_m[:, 0], boundary_m[:, 1])
    near_m = boundary_m[range_m <= grid.reach_m]
    apart_m = near_m[:, None] - near_m
    is_near = (apart_m**2).sum(axis=2) <= JOIN_M**2
    one, other = np.nonzero(np.triu(is_near, k=1))

    kerb = grid.positions(near_m)
    wall_starts, wall_ends = walls(rays, grid.cell_m)
    return Edges(
        starts=np.concatenate([kerb[one], wall_starts]),
        ends=np.concatenate([kerb[other], wall_ends]),
    )


def cut_links(edges: Edges, grid: LocalGrid) -> Floats:
    """Find the links that edges cross, (4, w, h), by how sure their place is, 0 to 1."""
    away = edges.middles() - grid.eye
    range_m = np.hypot(away[:, 0], away[:, 1]) * grid.cell_m
    certainty = grid.certainty(range_m)

    crossed = crossings(edges.starts, edges.ends)
    width, height = grid.extent.shape
    i = crossed.i - grid.extent.lower[0]
    j = crossed.j - grid.extent.lower[1]
    is_inside = (i >= 0) & (i < width) & (j >= 0) & (j < height)

    links = (crossed.direction[is_inside], i[is_inside], j[is_inside])
    cut = np.zeros((len(LINK_OFFSETS), width, height))
    np.maximum.at(cut, links, certainty[crossed.segment[is_inside]])
    return cut
