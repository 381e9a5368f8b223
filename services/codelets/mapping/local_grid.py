"""The place nodes around the agent, as dense arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from cogmap.geometry.se2 import transform_from
from cogmap.graph.window import Extent, Window
from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import PlaceColumn, Self
from cogmap.services.codelets.cells import changed_cells

# Beyond the reach: one for rounding, and one for links that lead there.
MARGIN_CELLS = 2
# The standard deviation of a distance seen over the distance, by which road, boundaries and
# obstacles far away count less: the paper's noise of distances (§6).
RANGE_SD_SHARE = 0.03


@dataclass(frozen=True, eq=False)
class LocalGrid:
    """The cells of a map within reach of a pose; arrays (w, h) are indexed [i, j] from the cell
    `extent.lower`. Positions on it are in cells of the map.

    What is seen errs by RANGE_SD_SHARE of its distance, and by the standard deviation of the pose.
    """

    map_id: str
    cell_m: float
    pose: Floats
    pose_sd_m: float
    reach_m: float
    extent: Extent

    @classmethod
    def around(cls, agent: Self, cell_m: float, reach_m: float) -> LocalGrid:
        """Make a grid of the cells within `reach_m` of the agent, and some more."""
        pose = np.array([agent.x_m, agent.y_m, agent.heading_rad])
        here_i, here_j = np.rint(pose[:2] / cell_m).astype(int).tolist()
        side = math.ceil(reach_m / cell_m) + MARGIN_CELLS
        return cls(
            map_id=agent.map,
            cell_m=cell_m,
            pose=pose,
            pose_sd_m=float(np.hypot(agent.x_sd_m, agent.y_sd_m)),
            reach_m=reach_m,
            extent=Extent((here_i - side, here_j - side), (here_i + side + 1, here_j + side + 1)),
        )

    @property
    def eye(self) -> Floats:
        """Return the position of the agent, (2,)."""
        position: Floats = self.pose[:2] / self.cell_m
        return position

    def positions(self, points_m: Floats) -> Floats:
        """Convert (n, 2) points in the robot's frame to positions."""
        return transform_from(self.pose, points_m) / self.cell_m

    def range_m(self) -> Floats:
        """Compute the distance of each cell from the agent, (w, h)."""
        at_i, at_j = self.eye.tolist()
        first_i, first_j = self.extent.lower
        last_i, last_j = self.extent.upper

        away_i = np.arange(first_i, last_i) - at_i
        away_j = np.arange(first_j, last_j) - at_j
        range_m: Floats = np.hypot(away_i[:, None], away_j) * self.cell_m
        return range_m

    def certainty(self, range_m: Floats) -> Floats:
        """Return how much something seen at these ranges is worth, 0 to 1: half if the standard
        deviation of its position is half a cell.

        The agent's own uncertainty counts for half a cell at most: while it explores, the map is as
        uncertain as the agent is, and what it sees lies right beside what it saw before.
        """
        half_m = self.cell_m / 2
        pose_sd_m = min(self.pose_sd_m, half_m)
        range_sd_m = RANGE_SD_SHARE * range_m

        variance_m2 = range_sd_m**2 + pose_sd_m**2
        certain: Floats = half_m**2 / (half_m**2 + variance_m2)
        return certain

    def has(self, positions: Floats) -> Booleans:
        """Decide whether any of (n, 2) positions lies in each cell, (w, h)."""
        return self.counts(positions) > 0

    def counts(self, positions: Floats) -> Indices:
        """Count how many of (n, 2) positions lie in each cell, (w, h)."""
        width, height = self.extent.shape
        cells = np.rint(positions).astype(np.int64) - self.extent.lower
        is_inside = (cells >= 0) & (cells < (width, height))

        i, j = cells[is_inside.all(axis=1)].T
        number = i * height + j
        found = np.bincount(number, minlength=width * height)
        return found.reshape(width, height)

    def changed(
        self, columns: Sequence[PlaceColumn], before: Singles, after: Singles
    ) -> list[Operation]:
        """Return the operations that write the cells whose value in one of k columns changes, from
        (k, w, h) `before` to `after`; none for a column that does not change.
        """
        known = Window(self.extent.lower, tuple(columns), before)
        return changed_cells(self.map_id, known, after)
