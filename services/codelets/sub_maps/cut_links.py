"""Boundaries as place nodes know them: the links that are cut."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.graph.graph import Graph
from cogmap.graph.window import CUT_BELOW, LINK_OFFSETS, WEIGHT_COLUMNS, Extent
from cogmap.schemas.nodes import ROOT_MAP

# A line visits every place that it passes: two points a cell miss none by more than a corner.
STEPS_A_CELL = 2


class CutLinks(NamedTuple):
    """The links that are cut, as boundaries: by the `weights` (4, w, h) of the links of a rectangle
    of place nodes, of which [0, 0] is cell `origin`.
    """

    origin: tuple[int, int]
    cell_m: float
    weights: Singles

    @classmethod
    def around(cls, graph: Graph, positions_m: Floats) -> CutLinks:
        """Read the boundaries of the root map in the rectangle that holds (n, 2) positions."""
        cell_m = graph.cell_m(ROOT_MAP)
        low_i, low_j = np.floor(positions_m.min(axis=0) / cell_m).astype(int).tolist()
        high_i, high_j = np.ceil(positions_m.max(axis=0) / cell_m).astype(int).tolist()
        extent = Extent((low_i, low_j), (high_i + 1, high_j + 1))

        window = graph.places.window(ROOT_MAP, WEIGHT_COLUMNS, extent)
        return cls(window.origin, cell_m, window.weights())

    def are_crossed(self, lines_m: Floats, clear_m: Floats | None = None) -> Booleans:
        """Decide for each of (k, 2, 2) lines whether some link along it is cut, (k,).

        Links within `clear_m` of its ends, (k, 2), do not count: they are of what stands there.
        Outside the rectangle nothing is known to be cut.
        """
        # The places that lines pass, in order, and the steps from each to a neighbour.
        cells = lines_m / self.cell_m - np.array(self.origin)
        along = cells[:, 1] - cells[:, 0]
        parts = np.ceil(STEPS_A_CELL * np.hypot(*along.T)).astype(np.int64) + 1
        line = np.repeat(np.arange(len(parts)), parts + 1)
        first = np.cumsum(parts + 1) - (parts + 1)
        share = (np.arange(len(line)) - first[line]) / parts[line]
        places = np.rint(cells[line, 0] + share[:, None] * along[line]).astype(np.int64)

        is_step = (line[1:] == line[:-1]) & (places[1:] != places[:-1]).any(axis=1)
        step_line = line[1:][is_step]
        before = places[:-1][is_step]
        after = places[1:][is_step]

        upper = self.weights.shape[1:]
        is_known = np.ones(len(before), bool)
        for ends in (before, after):
            is_known &= ((ends >= 0) & (ends < upper)).all(axis=1)

        offset = after - before
        is_cut = np.zeros(len(before), bool)
        for link, wanted in enumerate(LINK_OFFSETS):
            for owner, direction in ((before, wanted), (after, -wanted)):
                chosen = np.flatnonzero((offset == direction).all(axis=1) & is_known)
                i, j = owner[chosen].T
                is_cut[chosen] = self.weights[link, i, j] < CUT_BELOW

        if clear_m is not None:
            length_m = np.hypot(*(lines_m[:, 1] - lines_m[:, 0]).T)[step_line]
            along_m = ((share[1:] + share[:-1]) / 2)[is_step] * length_m
            is_cut &= along_m > clear_m[step_line, 0]
            is_cut &= length_m - along_m > clear_m[step_line, 1]

        is_crossed = np.zeros(len(lines_m), bool)
        is_crossed[step_line[is_cut]] = True
        return is_crossed
