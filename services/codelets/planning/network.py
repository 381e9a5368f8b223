"""Place networks: place nodes on a regular grid, linked to eight neighbours (paper §5.2)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from cogmap.graph.window import CUT_BELOW, LINK_OFFSETS

NEIGHBOUR_OFFSETS: Indices = np.concatenate([LINK_OFFSETS, -LINK_OFFSETS])
SQUARE = np.ones((3, 3), bool)
Cell = tuple[int, int]
Slices = tuple[slice, slice]


class PlaceNetwork(NamedTuple):
    """Place nodes of one map, and how well each link between two of them can be traversed.

    `origin`: the cell of index [0, 0]; cell (i, j) stands at (i * cell_m, j * cell_m) in the map's
    frame. `weights`: (4, width, height), of the links to the neighbours at LINK_OFFSETS, that is
    E, NE, N and NW; 0 is not traversable, 1 is free. Links have no direction.
    """

    origin: Cell
    cell_m: float
    weights: Singles

    @property
    def shape(self) -> tuple[int, int]:
        """How many cells wide and high."""
        _, width, height = self.weights.shape
        return width, height

    def contains(self, cell: Cell) -> bool:
        """Whether a cell of the map lies in the network."""
        i, j = self.index_of(cell)
        width, height = self.shape
        is_inside_i = 0 <= i < width
        is_inside_j = 0 <= j < height
        return is_inside_i and is_inside_j

    def index_of(self, cell: Cell) -> Cell:
        """The index in arrays of this network of a cell of the map."""
        i, j = cell
        first_i, first_j = self.origin
        return i - first_i, j - first_j


class Here(NamedTuple):
    """The rectangle of place nodes that is planned on."""

    origin: tuple[int, int]
    shape: tuple[int, int]
    cell_m: float

    def network(self, weights: Singles) -> PlaceNetwork:
        """Its place network, with links of (4, w, h) weights."""
        return PlaceNetwork(self.origin, self.cell_m, weights)

    def at(self, positions_m: Floats, values: Booleans) -> Booleans:
        """(n,): the (w, h) values at (n, 2) positions, false outside."""
        cells, is_inside = self._cells(positions_m)
        found = np.zeros(len(positions_m), bool)
        found[is_inside] = values[tuple(cells[is_inside].T)]
        return found

    def has(self, positions_m: Floats) -> Booleans:
        """(w, h): the cells of (n, 2) positions."""
        cells, is_inside = self._cells(positions_m)
        has = np.zeros(self.shape, bool)
        has[tuple(cells[is_inside].T)] = True
        return has

    def least(self, positions_m: Floats, values: Floats) -> Floats:
        """(w, h): the least of the (n,) values at (n, 2) positions in each cell, infinite where
        there is none.
        """
        cells, is_inside = self._cells(positions_m)
        least = np.full(self.shape, np.inf)
        np.minimum.at(least, tuple(cells[is_inside].T), values[is_inside])
        return least

    def is_within(self, within_m: float, positions_m: Floats) -> Booleans:
        """(w, h): the cells within a distance of any of (n, 2) positions."""
        has = self.has(positions_m)
        if not has.any():
            return has

        distance_m = ndimage.distance_transform_edt(~has) * self.cell_m
        return np.asarray(distance_m <= within_m)

    def _cells(self, positions_m: Floats) -> tuple[Indices, Booleans]:
        """(n, 2) and (n,): the indices of positions, and which are inside."""
        cells = np.rint(positions_m / self.cell_m).astype(np.int64) - np.array(self.origin)
        return cells, ((cells >= 0) & (cells < self.shape)).all(axis=1)


def grid_network(free: Booleans, cell_m: float = 1.0, origin: Cell = (0, 0)) -> PlaceNetwork:
    """The network of a grid whose cells are `free`, (width, height), or blocked.

    A diagonal link exists only where both cells beside it are free too: no corner is cut.
    """
    around = np.pad(free, 1)
    width, height = free.shape
    weights = np.empty((len(LINK_OFFSETS), width, height), np.float32)

    for link, (di, dj) in enumerate(LINK_OFFSETS.tolist()):
        beside_i = _shifted(around, di, 0)
        beside_j = _shifted(around, 0, dj)
        across = _shifted(around, di, dj)
        weights[link] = free & beside_i & beside_j & across

    return PlaceNetwork(origin, cell_m, weights)


def _shifted(around: Booleans, di: int, dj: int) -> Booleans:
    """The neighbours at an offset, of a grid that is padded by one cell on each side."""
    width, height = around.shape
    i = slice(1 + di, width - 1 + di)
    j = slice(1 + dj, height - 1 + dj)
    return around[i, j]


def ends(shape: tuple[int, int], offset: tuple[int, int]) -> tuple[Slices, Slices]:
    """The places of a (w, h) grid that have a neighbour at `offset`, and those neighbours."""
    here = []
    there = []
    for size, step in zip(shape, offset, strict=True):
        here.append(slice(max(0, -step), size - max(0, step)))
        there.append(slice(max(0, step), size - max(0, -step)))

    return (here[0], here[1]), (there[0], there[1])


def link_weights(weights: Singles, share: Floats) -> Singles:
    """(4, w, h): the weights of links that are not cut, by the lower share of the two places each
    joins.
    """
    _, width, height = weights.shape
    links = np.zeros_like(weights)
    for number, offset in enumerate(LINK_OFFSETS.tolist()):
        here, there = ends((width, height), offset)
        lower = np.minimum(share[here], share[there])
        links[number][here] = lower * (weights[number][here] >= CUT_BELOW)

    return links
