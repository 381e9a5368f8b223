"""Boundaries as a place network knows them: the links that are cut."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.graph.graph import Graph
from cogmap.graph.window import WEIGHT_COLUMNS, Extent
from schemas.nodes import ROOT_MAP
from services.codelets.planning.network import LINK_OFFSETS, PlaceNetwork
from services.codelets.structure.crossings import Boundaries

CUT_BELOW = 0.5


def boundaries_around(graph: Graph, positions_m: Floats) -> Boundaries:
    """The boundaries of the root map in the rectangle that holds (n, 2) positions."""
    cell_m = graph.cell_m(ROOT_MAP)
    low_i, low_j = np.floor(positions_m.min(axis=0) / cell_m).astype(int).tolist()
    high_i, high_j = np.ceil(positions_m.max(axis=0) / cell_m).astype(int).tolist()
    extent = Extent((low_i, low_j), (high_i + 1, high_j + 1))

    window = graph.places.window(ROOT_MAP, WEIGHT_COLUMNS, extent)
    network = PlaceNetwork(window.origin, cell_m, window.weights())
    return Boundaries(boundary_segments(network))


def boundary_segments(network: PlaceNetwork) -> Floats:
    """(m, 2, 2): for each link of weight below CUT_BELOW to an eastern or northern neighbour in the
    network, the side that the two cells share, in the map's frame.

    Whoever passes between two cells at a corner passes the corner of two such sides as well, so
    diagonal links need none.
    """
    segments_m = [np.zeros((0, 2, 2))]
    for link, offset in enumerate(LINK_OFFSETS):
        if not offset.prod():
            segments_m.append(_sides(network, network.weights[link] < CUT_BELOW, offset))

    return np.concatenate(segments_m)


def _sides(network: PlaceNetwork, is_cut: Booleans, offset: Indices) -> Floats:
    """(k, 2, 2): the sides that cells (width, height) whose link is cut share with the neighbour at
    an offset, where that is in the network.
    """
    width, height = network.shape
    inside = is_cut[: width - offset[0], : height - offset[1]]
    cells = np.argwhere(inside) + np.array(network.origin)

    middle = cells + offset / 2
    along = np.array([offset[1], offset[0]]) / 2
    sides: Floats = np.stack([middle - along, middle + along], axis=1) * network.cell_m
    return sides
