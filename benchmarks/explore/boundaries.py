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
    crossed = _crossed(starts, ends, window)

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
    """(n, 2): the middles, in cells, of (n, 3) links: direction, i and j within the window."""
    cells = links[:, 1:] + window.origin
    middles: Floats = cells + LINK_OFFSETS[links[:, 0]] / 2
    return middles


def _crossed(starts: Floats, ends: Floats, window: Window) -> Floats:
    """(n, 2): the middles of the links between known place nodes, or to one, that are crossed."""
    found = crossings(starts, ends)
    links = np.column_stack([found.direction, found.i, found.j])
    links = np.unique(links, axis=0)
    links[:, 1:] -= window.origin

    cells = links[:, 1:]
    beyond = cells + LINK_OFFSETS[links[:, 0]]
    known = _known(window)
    is_inside = _is_inside(cells, known) & _is_inside(beyond, known)
    links = links[is_inside]

    here = known[tuple(cells[is_inside].T)]
    there = known[tuple(beyond[is_inside].T)]
    return _middles(links[here | there], window)


def _is_inside(cells: Indices, values: Booleans) -> Booleans:
    is_inside = (cells >= 0) & (cells < values.shape)
    return np.asarray(is_inside.all(axis=1))


def _known(window: Window) -> Booleans:
    """(w, h): the place nodes with evidence on any of their own links."""
    has_evidence = window.evidence() != 0
    return np.asarray(has_evidence.any(axis=0))
