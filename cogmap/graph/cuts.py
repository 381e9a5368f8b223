"""The links between place nodes that are cut, as lines on the ground."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.graph.window import CUT_BELOW, LINK_OFFSETS, WEIGHT_COLUMNS
from cogmap.schemas.nodes import ROOT_MAP

STRAIGHT_LINKS = (0, 2)


def cut_links_m(graph: Graph) -> Floats:
    """Return the side that the two place nodes of each straight link share that is cut, of the root
    map: both ends, (n, 2, 2).
    """
    extent = graph.places.extent(ROOT_MAP)
    window = graph.places.window(ROOT_MAP, WEIGHT_COLUMNS, extent)
    weights = window.weights()
    sides = [np.zeros((0, 2, 2))]
    for link in STRAIGHT_LINKS:
        offset = LINK_OFFSETS[link]
        cells = np.argwhere(weights[link] < CUT_BELOW) + np.array(window.origin)
        middles = cells + offset / 2
        across = offset[::-1] / 2
        sides.append(np.stack([middles - across, middles + across], axis=1))

    ends_m: Floats = np.vstack(sides) * graph.cell_m()
    return ends_m
