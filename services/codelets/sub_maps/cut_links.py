"""Boundaries as place nodes know them: the links that are cut."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
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
        """The boundaries of the root map in the rectangle that holds (n, 2) positions."""
        cell_m = graph.cell_m(ROOT_MAP)
        low_i, low_j = np.floor(positions_m.min(axis=0) / cell_m).astype(int).tolist()
        high_i, high_j = np.ceil(positions_m.max(axis=0) / cell_m).astype(int).tolist()
        extent = Extent((low_i, low_j), (high_i + 1, high_j + 1))

        window = graph.places.window(ROOT_MAP, WEIGHT_COLUMNS, extent)
        return cls(window.origin, cell_m, window.weights())

    def are_crossed(self, lines_m: Floats, clear_m: Floats | None = None) -> Booleans:
        """(k,): if some link along each of (k, 2, 2) lines is cut.

        Links within `clear_m` of its ends, (k, 2), do not count: they are of what stands there.
        Outside the rectangle nothing is known to be cut.
        """
        cells = lines_m / self.cell_m - np.array(self.origin)
        steps = _steps_along(cells)
        is_cut = self._are_cut(steps.before, steps.after)

        if clear_m is not None:
            length_m = np.hypot(*(lines_m[:, 1] - lines_m[:, 0]).T)[steps.line]
            along_m = steps.share * length_m
            is_cut &= along_m > clear_m[steps.line, 0]
            is_cut &= length_m - along_m > clear_m[steps.line, 1]

        is_crossed = np.zeros(len(lines_m), bool)
        is_crossed[steps.line[is_cut]] = True
        return is_crossed

    def _are_cut(self, before: Indices, after: Indices) -> Booleans:
        """(s,): if the link between two neighbouring places, (s, 2) indices, is cut."""
        upper = self.weights.shape[1:]
        is_known = np.ones(len(before), bool)
        for places in (before, after):
            is_known &= ((places >= 0) & (places < upper)).all(axis=1)

        offset = after - before
        is_cut = np.zeros(len(before), bool)
        for link, wanted in enumerate(LINK_OFFSETS):
            for owner, direction in ((before, wanted), (after, -wanted)):
                chosen = np.flatnonzero((offset == direction).all(axis=1) & is_known)
                i, j = owner[chosen].T
                is_cut[chosen] = self.weights[link, i, j] < CUT_BELOW

        return is_cut


class _Steps(NamedTuple):
    """Steps from one place to a neighbour along lines: the line, (s,), the places before and after,
    (s, 2), and how far along the line that is, as a share, (s,).
    """

    line: Indices
    before: Indices
    after: Indices
    share: Floats


def _steps_along(cells: Floats) -> _Steps:
    """The steps from place to place along (k, 2, 2) lines, in cells."""
    along = cells[:, 1] - cells[:, 0]
    parts = np.ceil(STEPS_A_CELL * np.hypot(*along.T)).astype(np.int64) + 1
    line = np.repeat(np.arange(len(parts)), parts + 1)
    first = np.cumsum(parts + 1) - (parts + 1)
    share = (np.arange(len(line)) - first[line]) / parts[line]

    points = cells[line, 0] + share[:, None] * along[line]
    places = np.rint(points).astype(np.int64)

    is_step = (line[1:] == line[:-1]) & (places[1:] != places[:-1]).any(axis=1)
    middle = (share[1:] + share[:-1]) / 2
    return _Steps(
        line=line[1:][is_step],
        before=places[:-1][is_step],
        after=places[1:][is_step],
        share=middle[is_step],
    )
