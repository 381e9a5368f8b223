"""The place nodes around the agent, as dense arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Floats, Indices, Singles
from cogmap.geometry.se2 import transform_from
from cogmap.graph.window import Extent
from schemas.array import Array
from schemas.graph import Cells, Operation
from schemas.nodes import PlaceColumn, Self

MARGIN_CELLS = 2


@dataclass(frozen=True, eq=False)
class LocalGrid:
    """The cells of a map within reach of a pose, arrays (w, h) being indexed [i, j] from the cell
    `extent.lower`. Positions on it are in cells.
    """

    map_id: str
    cell_m: float
    pose: Floats
    pose_sd_m: float
    extent: Extent

    @classmethod
    def around(cls, agent: Self, cell_m: float, reach_m: float) -> LocalGrid:
        """The cells within `reach_m` of the agent, and some more."""
        pose = np.array([agent.x_m, agent.y_m, agent.heading_rad])
        here = np.rint(pose[:2] / cell_m).astype(np.int64)
        reach = int(np.ceil(reach_m / cell_m)) + MARGIN_CELLS
        lower_i, lower_j = (here - reach).tolist()
        upper_i, upper_j = (here + reach + 1).tolist()

        pose_sd_m = float(np.hypot(agent.x_sd_m, agent.y_sd_m))
        extent = Extent((lower_i, lower_j), (upper_i, upper_j))
        return cls(agent.map, cell_m, pose, pose_sd_m, extent)

    def positions(self, points_m: Floats) -> Floats:
        """(n, 2) points in the robot's frame, as positions in cells."""
        return transform_from(self.pose, points_m) / self.cell_m

    def range_m(self) -> Floats:
        """(w, h): the distance of each cell from the agent."""
        i, j = np.indices(self.extent.shape)
        away_i = i + self.extent.lower[0] - self.pose[0] / self.cell_m
        away_j = j + self.extent.lower[1] - self.pose[1] / self.cell_m
        range_m: Floats = np.hypot(away_i, away_j) * self.cell_m
        return range_m

    def certainty(self, range_m: Floats, range_sd_share: float) -> Floats:
        """How much something seen at these ranges is worth, 0 to 1: half where the standard
        deviation of its position is half a cell.

        The agent's own uncertainty counts for half a cell at most: while it explores, the map is
        as uncertain as the agent is, and what it sees lies right beside what it saw before.
        """
        half_m = self.cell_m / 2
        pose_sd_m = min(self.pose_sd_m, half_m)
        variance_m2 = (range_sd_share * range_m) ** 2 + pose_sd_m**2
        certain: Floats = half_m**2 / (half_m**2 + variance_m2)
        return certain

    def counts(self, positions: Floats) -> Indices:
        """(w, h): how many of (n, 2) positions lie in each cell."""
        cells = np.rint(positions).astype(np.int64) - self.extent.lower
        width, height = self.extent.shape
        is_inside = ((cells >= 0) & (cells < (width, height))).all(axis=1)
        i, j = cells[is_inside].T
        found = np.bincount(i * height + j, minlength=width * height)
        return found.reshape(width, height)

    def changed(
        self, columns: Sequence[PlaceColumn], before: Singles, after: Singles
    ) -> list[Operation]:
        """The operations that write the cells whose value in one of k columns changes, from
        (k, w, h) `before` to `after`; none of a column that does not.
        """
        column, i, j = np.nonzero(after != before)
        cells = np.column_stack([i, j]) + self.extent.lower
        values = after[column, i, j]
        ends = np.searchsorted(column, np.arange(len(columns)), side="right").tolist()

        operations: list[Operation] = []
        start = 0
        for name, end in zip(columns, ends, strict=True):
            if end > start:
                operation = Cells(
                    map=self.map_id,
                    column=name,
                    cells=Array.of(cells[start:end], "<i4"),
                    values=Array.of(values[start:end], "<f4"),
                )
                operations.append(operation)
            start = end

        return operations
