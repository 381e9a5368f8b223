"""A straight street between walls, as perception would publish it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import transform_to
from cogmap.graph.graph import Graph
from cogmap.schemas.array import Array
from cogmap.schemas.codelets import Task
from cogmap.schemas.nodes import Self
from cogmap.services.codelets.config import Config
from cogmap.testing import agent, task
from tests.support.world.scenes import run

HALF_VIEW_RAD = math.radians(37)
RAYS = 32
NEAREST_M = 2.6
FARTHEST_M = 15.0
THINNED_M = 0.5
BEFORE_M = 20.0
NOTHING: npt.ArrayLike = ()


@dataclass(frozen=True)
class View:
    """Points of the road, points where it ends, and bearing and range of rays, (n, 2) each, in the
    robot's frame.
    """

    road_m: npt.ArrayLike = NOTHING
    boundary_m: npt.ArrayLike = NOTHING
    rays: npt.ArrayLike = NOTHING

    def task(self, codelet: str) -> Task:
        """The task of a codelet about it."""
        return task(
            codelet,
            road_m=_array(self.road_m),
            road_boundary_m=_array(self.boundary_m),
            scan=_array(self.rays),
        )


def _array(points: npt.ArrayLike) -> Array:
    values = np.asarray(points, np.float32)
    return Array.of(values.reshape(-1, 2))


def self_at(pose: npt.ArrayLike, sd_m: float = 0.0) -> Self:
    """The self node at a pose."""
    x_m, y_m, heading_rad = np.asarray(pose, np.float64).tolist()
    samples = np.tile((x_m, y_m, heading_rad), (50, 1))
    return agent(
        samples, x_m=x_m, y_m=y_m, heading_rad=heading_rad, x_sd_m=sd_m / 2, y_sd_m=sd_m / 2
    )


def see(graph: Graph, view: View, config: Config, *codelets: str) -> int:
    """Let codelets answer what they are asked about a view; how many cells they write."""
    written = 0
    for name in codelets:
        operations = run(view.task(name), graph, config).operations
        graph.change(operations)
        for operation in operations:
            written += operation.cells.shape[0]  # type: ignore[union-attr]

    return written


@dataclass
class Street:
    """A street along x, kerbs `half_m` and walls `wall_m` from its middle, which perception sees
    with an error of `range_sd` of each distance, and beside its place by `view_sd_m`.
    """

    half_m: float
    wall_m: float
    range_sd: float = 0.0
    view_sd_m: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)

    def boundaries_m(self, length_m: float) -> Floats:
        """(4, 4): kerbs and walls, the ends of each."""
        rows = []
        for left_m in (self.half_m, -self.half_m, self.wall_m, -self.wall_m):
            rows.append((-BEFORE_M, left_m, length_m + BEFORE_M, left_m))
        return np.array(rows)

    def view(self, pose: npt.ArrayLike) -> View:
        """What is seen from a pose."""
        here = np.asarray(pose, np.float64)
        beside_m = self._rng.normal(0.0, 1.0, 2) * self.view_sd_m

        along_m = here[0] + np.arange(-BEFORE_M, BEFORE_M, 0.25)
        across_m = np.arange(-self.half_m + 0.05, self.half_m, 0.25)
        ground_m = np.stack(np.meshgrid(along_m, across_m), -1).reshape(-1, 2)
        road_m = _thinned(_seen(ground_m, here)) + beside_m

        kerb_m = here[0] + np.arange(-BEFORE_M, BEFORE_M, 0.1)
        sides = [np.column_stack([kerb_m, np.full(kerb_m.shape, y_m)]) for y_m in self._kerbs_m]
        boundary_m = _thinned(_seen(np.concatenate(sides), here)) + beside_m
        boundary_m *= self._factors(len(boundary_m))[:, None]
        return View(road_m, boundary_m, self._rays(here))

    @property
    def _kerbs_m(self) -> tuple[float, float]:
        return self.half_m, -self.half_m

    def _factors(self, number: int) -> Floats:
        return 1 + self._rng.normal(0.0, 1.0, number) * self.range_sd

    def _rays(self, here: Floats) -> Floats:
        bearing_rad = np.linspace(HALF_VIEW_RAD, -HALF_VIEW_RAD, RAYS)
        across = np.sin(bearing_rad + here[2])
        wall_m = np.where(across > 0, self.wall_m, -self.wall_m) - here[1]
        range_m = np.minimum(wall_m / across, 60.0) * self._factors(RAYS)
        return np.column_stack([bearing_rad, range_m])


def _seen(points_m: Floats, pose: Floats) -> Floats:
    """Those of (n, 2) points on the ground that are in the field of view, in the robot's frame."""
    robot_m = transform_to(pose, points_m)
    range_m = np.hypot(robot_m[:, 0], robot_m[:, 1])
    bearing_rad = np.arctan2(robot_m[:, 1], robot_m[:, 0])

    is_ahead = (robot_m[:, 0] > NEAREST_M) & (range_m < FARTHEST_M)
    is_seen: Booleans = is_ahead & (np.abs(bearing_rad) < HALF_VIEW_RAD)
    return np.asarray(robot_m[is_seen])


def _thinned(points_m: Floats) -> Floats:
    """The mean of the points in each cell, as perception publishes them."""
    cells = np.floor(points_m / THINNED_M).astype(np.int64)
    _, number, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    sums_m = np.zeros((len(counts), 2))
    np.add.at(sums_m, number.reshape(-1), points_m)
    return np.asarray(sums_m / counts[:, None])
