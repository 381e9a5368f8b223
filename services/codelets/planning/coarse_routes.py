"""Routes over the places of a map that is coarser than the one to be driven on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.graph.graph import Graph
from cogmap.graph.window import ROAD_FROM, WEIGHT_COLUMNS, Extent
from cogmap.schemas.nodes import PlaceColumn
from cogmap.services.codelets.planning.activation import Links, spread
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.network import Cell, PlaceNetwork, uncut_links

COLUMNS = (PlaceColumn.ROAD, *WEIGHT_COLUMNS)

SNAP = 2
"""In cells, how far from a position the place may be from which it is reached."""


class Routes(NamedTuple):
    """A rectangle of a map, and the cells of it that routes lead through, (w, h)."""

    lower: Cell
    is_passed: Booleans


def coarse_network(
    graph: Graph,
    map_id: str,
    extent: Extent,
    config: Config,
    is_inside: Booleans | None = None,
) -> PlaceNetwork:
    """Make the place network of a rectangle of a map, or of what `is_inside` of it, (w, h)."""
    window = graph.places.window(map_id, COLUMNS, extent)
    is_road = window.column(PlaceColumn.ROAD) >= ROAD_FROM
    share = np.where(is_road, 1.0, 1 / config.unknown_cost)
    if is_inside is not None:
        share[~is_inside] = 0.0

    return PlaceNetwork(window.origin, graph.cell_m(map_id), uncut_links(window.weights(), share))


def routes_between(
    network: PlaceNetwork, ends_m: Floats, max_cost_m: Floats | None = None
) -> Routes | None:
    """Find the routes between each two of (n, 2) positions; None if one is outside, or not
    connected, or a route costs more than those two's `max_cost_m`, (n, n).
    """
    is_linked = network.is_linked()
    cells: list[Cell] = []
    for end_m in ends_m:
        cell = _linked(network, is_linked, end_m)
        if cell is None:
            return None
        cells.append(cell)

    links = Links(network)
    is_passed = np.zeros(network.shape, bool)
    for number, goal in enumerate(cells[1:], start=1):
        until = cells[0] if number == 1 else None
        field = spread(network, np.array([goal]), links, until)
        for other, start in enumerate(cells[:number]):
            route = field.climb(start)
            if route is None:
                return None
            cost_m = field.distance_m[network.index_of(start)]
            if max_cost_m is not None and cost_m > max_cost_m[number, other]:
                return None
            is_passed[tuple((route - network.origin).T)] = True

    return Routes(network.origin, is_passed)


def _linked(network: PlaceNetwork, is_linked: Booleans, position_m: Floats) -> Cell | None:
    """Return the cell nearest to a position that a link leads to, within SNAP."""
    middle = np.rint(position_m / network.cell_m).astype(np.int64)
    around = np.argwhere(np.ones((2 * SNAP + 1, 2 * SNAP + 1))) - SNAP
    cells = middle + around[np.hypot(*around.T).argsort(kind="stable")]
    for i, j in cells.tolist():
        if network.contains((i, j)) and is_linked[network.index_of((i, j))]:
            return i, j

    return None
