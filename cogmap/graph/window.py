"""A rectangle of place nodes as dense arrays, for what computes on many of them at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Singles
from cogmap.schemas.nodes import PlaceColumn

WEIGHT_COLUMNS = (
    PlaceColumn.WEIGHT_E,
    PlaceColumn.WEIGHT_NE,
    PlaceColumn.WEIGHT_N,
    PlaceColumn.WEIGHT_NW,
)
EVIDENCE_COLUMNS = (
    PlaceColumn.EVIDENCE_E,
    PlaceColumn.EVIDENCE_NE,
    PlaceColumn.EVIDENCE_N,
    PlaceColumn.EVIDENCE_NW,
)
LINK_OFFSETS = np.array([(1, 0), (1, 1), (0, 1), (-1, 1)])
"""The offset of the neighbour that each of a cell's own four links leads to, in their order."""

CUT_BELOW = 0.5
"""A link of a lower weight is cut."""

ROAD_FROM = 0.3
"""A place node of at least this share is road."""

OBSTACLE_FROM = 0.5
"""Something stands at a place node of at least this share."""


@dataclass(frozen=True, eq=False)
class Extent:
    """The cells (i, j) of a map with `lower` <= (i, j) < `upper`."""

    lower: tuple[int, int]
    upper: tuple[int, int]

    @property
    def shape(self) -> tuple[int, int]:
        """Return how many cells it has in each direction."""
        width = max(0, self.upper[0] - self.lower[0])
        height = max(0, self.upper[1] - self.lower[1])
        return width, height

    def grown(self, cells: int) -> Extent:
        """Return the rectangle with so many cells more on each side."""
        (low_i, low_j), (high_i, high_j) = self.lower, self.upper
        return Extent((low_i - cells, low_j - cells), (high_i + cells, high_j + cells))


@dataclass(frozen=True, eq=False)
class Window:
    """Some columns of a rectangle of place nodes, copied: `values` (k, width, height), float32.

    `values[c, i, j]` is column `columns[c]` of cell (i, j) + `origin`. Cells whose tile does not
    exist have each column's default.
    """

    origin: tuple[int, int]
    columns: tuple[PlaceColumn, ...]
    values: Singles

    @property
    def shape(self) -> tuple[int, int]:
        """Return how many cells it has in each direction."""
        _, width, height = self.values.shape
        return width, height

    def column(self, name: PlaceColumn) -> Singles:
        """Return one column, (width, height). Raises ValueError if the window lacks it."""
        values: Singles = self.values[self.columns.index(name)]
        return values

    def weights(self) -> Singles:
        """Return the weights of links by direction, (4, width, height), in the order of
        LINK_OFFSETS.
        """
        return self._stack(WEIGHT_COLUMNS)

    def evidence(self) -> Singles:
        """Return the evidence of links by direction, (4, width, height), 0 if never seen."""
        return self._stack(EVIDENCE_COLUMNS)

    def _stack(self, names: tuple[PlaceColumn, ...]) -> Singles:
        first = self.columns.index(names[0])
        last = first + len(names)
        if self.columns[first:last] == names:
            return np.asarray(self.values[first:last])

        return np.stack([self.column(name) for name in names])
