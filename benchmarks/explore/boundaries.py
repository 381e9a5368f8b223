"""How true the links of a map are: those that are cut, against the walls and kerbs there are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.polylines import nearest_on_pieces
from cogmap.graph.crossings import crossings
from cogmap.graph.window import CUT_BELOW, LINK_OFFSETS, Window


class BoundaryScore(NamedTuple):
    """Precision: the share of the `cut` links that lie within a cell of a wall or kerb. Recall: the
    share of the `crossed` links, those that one crosses where the map is known, that have a cut
    link within a cell. NaN where there are none.
    """

    precision: float
    recall: float
    cut: int
    crossed: int


def boundary_score(window: Window, cell_m: float, boundaries_m: Floats) -> BoundaryScore:
    """Compare the links of a map, whose weights and evidence `window` has, with (n, 4) segments of
    walls and kerbs in the map's frame: x and y of one end, then of the other.

    A place node is known where one of its links has evidence.
    """
    starts = boundaries_m[:, :2] / cell_m
    ends = boundaries_m[:, 2:] / cell_m
    cut = _middles(np.argwhere(window.weights() < CUT_BELOW), window)

    # The links between known place nodes, or to one, that a wall or kerb crosses.
    known = (window.evidence() != 0).any(axis=0)
    found = crossings(starts, ends)
    links = np.unique(np.column_stack([found.direction, found.i, found.j]), axis=0)
    links[:, 1:] -= window.origin
    cells = links[:, 1:]
    beyond = cells + LINK_OFFSETS[links[:, 0]]
    is_inside = _is_inside(cells, known) & _is_inside(beyond, known)
    is_known = known[tuple(cells[is_inside].T)] | known[tuple(beyond[is_inside].T)]
    crossed = _middles(links[is_inside][is_known], window)

    precision = float("nan")
    if len(cut):
        nearest = nearest_on_pieces(starts, ends, cut)
        away = np.hypot(*(nearest.foot_m - cut).T)
        precision = float((away <= 1.0).mean())

    recall = float("nan")
    if len(crossed):
        away = np.full(len(crossed), np.inf)
        if len(cut):
            away, _ = cKDTree(cut).query(crossed)
        recall = float((away <= 1.0).mean())

    return BoundaryScore(precision, recall, len(cut), len(crossed))


def _middles(links: Indices, window: Window) -> Floats:
    """Return the (n, 2) middles, in cells, of (n, 3) links: direction, i and j in the window."""
    cells = links[:, 1:] + window.origin
    middles: Floats = cells + LINK_OFFSETS[links[:, 0]] / 2
    return middles


def _is_inside(cells: Indices, values: Booleans) -> Booleans:
    is_inside = (cells >= 0) & (cells < values.shape)
    return np.asarray(is_inside.all(axis=1))
