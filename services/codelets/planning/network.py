"""Place networks: place nodes on a regular grid, linked to eight neighbours (paper §5.2)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from cogmap.graph.window import CUT_BELOW, LINK_OFFSETS

EIGHT = np.ones((3, 3), bool)
"""Connects places to their eight neighbours, as scipy.ndimage takes it."""

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
        """Count the cells in width and height."""
        _, width, height = self.weights.shape
        return width, height

    def is_linked(self) -> Booleans:
        """Mark the cells that a link leads to, (w, h)."""
        is_linked = np.zeros(self.shape, bool)
        for of_link, offset in zip(self.weights > 0, LINK_OFFSETS.tolist(), strict=True):
            here, there = ends(self.shape, offset)
            is_linked[here] |= of_link[here]
            is_linked[there] |= of_link[here]
        return is_linked

    def contains(self, cell: Cell) -> bool:
        """Decide whether a cell of the map lies in the network."""
        i, j = self.index_of(cell)
        width, height = self.shape
        return 0 <= i < width and 0 <= j < height

    def index_of(self, cell: Cell) -> Cell:
        """Return the index in arrays of this network of a cell of the map."""
        i, j = cell
        first_i, first_j = self.origin
        return i - first_i, j - first_j

    def cost_m(self, cells: Indices) -> float:
        """Sum up what a route of (n, 2) neighbouring cells costs; infinite if a link of it is cut,
        or leads outside.
        """
        inside = cells - np.array(self.origin)
        if (inside < 0).any() or (inside >= self.shape).any():
            return math.inf

        here = inside[:-1]
        there = inside[1:]
        weights = np.zeros(len(here))
        for of_link, offset in zip(self.weights, LINK_OFFSETS, strict=True):
            forth = (there - here == offset).all(axis=1)
            back = (here - there == offset).all(axis=1)
            weights[forth] = of_link[tuple(here[forth].T)]
            weights[back] = of_link[tuple(there[back].T)]

        if not weights.all():
            return math.inf
        steps_m = np.hypot(*np.diff(cells, axis=0).T) * self.cell_m
        return float((steps_m / weights).sum())


class PlaceGrid(NamedTuple):
    """The cells of a rectangle of a map, the first of them `origin`."""

    origin: Cell
    shape: tuple[int, int]
    cell_m: float

    def at(self, positions_m: Floats, values: Booleans) -> Booleans:
        """Return the (w, h) values at (n, 2) positions, false outside."""
        cells, is_inside = self._cells(positions_m)
        found = np.zeros(len(positions_m), bool)
        found[is_inside] = values[tuple(cells[is_inside].T)]
        return found

    def has(self, positions_m: Floats) -> Booleans:
        """Mark the cells (w, h) of (n, 2) positions."""
        cells, is_inside = self._cells(positions_m)
        has = np.zeros(self.shape, bool)
        has[tuple(cells[is_inside].T)] = True
        return has

    def minimum(self, positions_m: Floats, values: Floats) -> Singles:
        """Return the minimum of the (n,) values at (n, 2) positions in each cell, (w, h), infinite
        if there is none.
        """
        cells, is_inside = self._cells(positions_m)
        minimum = np.full(self.shape, np.inf, np.float32)
        np.minimum.at(minimum, tuple(cells[is_inside].T), values[is_inside])
        return minimum

    def is_within(self, within_m: float, positions_m: Floats) -> Booleans:
        """Mark the cells (w, h) within a distance of any of (n, 2) positions."""
        has = self.has(positions_m)
        is_within = np.zeros(self.shape, bool)
        if not has.any():
            return is_within

        # Distances are computed around the positions alone, often a small part of the map.
        margin = int(np.ceil(within_m / self.cell_m))
        i = np.flatnonzero(has.any(axis=1))
        j = np.flatnonzero(has.any(axis=0))
        around = (
            slice(max(0, int(i[0]) - margin), int(i[-1]) + margin + 1),
            slice(max(0, int(j[0]) - margin), int(j[-1]) + margin + 1),
        )
        distance_m = ndimage.distance_transform_edt(~has[around]) * self.cell_m
        is_within[around] = distance_m <= within_m
        return is_within

    def _cells(self, positions_m: Floats) -> tuple[Indices, Booleans]:
        """Return the (n, 2) indices of positions, and which of them are inside."""
        cells = np.rint(positions_m / self.cell_m).astype(np.int64) - np.array(self.origin)
        return cells, ((cells >= 0) & (cells < self.shape)).all(axis=1)


def place_network(
    cost: Singles | Floats, cell_m: float = 1.0, origin: Cell = (0, 0)
) -> PlaceNetwork:
    """Make the network of places that cost so many times their length to drive over, (w, h), at
    least 1; infinite where they are blocked.

    A link costs as much as the dearer of the two places that it joins. A diagonal link exists only
    if neither place beside it is blocked: no corner is cut.
    """
    ease = (1 / cost).astype(np.float32)
    weights = np.zeros((len(LINK_OFFSETS), *cost.shape), np.float32)
    for number, offset in enumerate(LINK_OFFSETS.tolist()):
        here, there = ends(cost.shape, offset)
        along_i = there[0], here[1]
        along_j = here[0], there[1]

        weights[number][here] = np.minimum(ease[here], ease[there])
        weights[number][here] *= (ease[along_i] > 0) & (ease[along_j] > 0)

    return PlaceNetwork(origin, cell_m, weights)


def grid_network(free: Booleans, cell_m: float = 1.0, origin: Cell = (0, 0)) -> PlaceNetwork:
    """Make the network of a grid whose cells are `free`, (width, height), or blocked."""
    return place_network(np.where(free, 1.0, np.inf), cell_m, origin)


def with_beside(mask: Booleans) -> Booleans:
    """Mark the places of a (w, h) mask, and the eight beside each."""
    rows = mask.copy()
    rows[1:] |= mask[:-1]
    rows[:-1] |= mask[1:]
    beside = rows.copy()
    beside[:, 1:] |= rows[:, :-1]
    beside[:, :-1] |= rows[:, 1:]
    return beside


def ends(shape: tuple[int, ...], offset: tuple[int, int]) -> tuple[Slices, Slices]:
    """Return the places of a (w, h) grid with a neighbour at `offset`, and those neighbours."""
    here = []
    there = []
    for size, step in zip(shape, offset, strict=True):
        here.append(slice(max(0, -step), size - max(0, step)))
        there.append(slice(max(0, step), size - max(0, -step)))

    return (here[0], here[1]), (there[0], there[1])


def uncut_links(weights: Singles, share: Floats) -> Singles:
    """Return the (4, w, h) weights of links that are not cut, by the lower share of the two places
    each joins.
    """
    _, width, height = weights.shape
    links = np.zeros_like(weights)
    for number, offset in enumerate(LINK_OFFSETS.tolist()):
        here, there = ends((width, height), offset)
        lower = np.minimum(share[here], share[there])
        links[number][here] = lower * (weights[number][here] >= CUT_BELOW)

    return links
