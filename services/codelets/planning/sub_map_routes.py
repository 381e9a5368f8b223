"""Routes on the grid of one sub-map that holds start and goals (paper §5.5)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from, transform_to
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import Map
from cogmap.services.codelets.planning.coarse_routes import coarse_network, routes_between
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.sub_maps.members import pose_of
from cogmap.services.codelets.sub_maps.sub_map_grid import area_of, with_places


class SubMapRoutes(NamedTuple):
    """Routes within a sub-map: the positions on the root map that they pass, (k, 2), and how far
    apart the sub-map's places are.
    """

    passed_m: Floats
    cell_m: float


def sub_map_routes(graph: Graph, ends_m: Floats, config: Config) -> SubMapRoutes | None:
    """Find the routes between each two of (n, 2) positions within the largest sub-map that holds
    them all; None if there is none, or a route that leaves it might be shorter.
    """
    for node in _sub_maps_around(graph, ends_m):
        pose = pose_of(node)
        own_m = transform_to(pose, ends_m)
        network = coarse_network(graph, node.id, area_of(node), config)
        routes = routes_between(network, own_m, _outside_m(node, own_m))
        if routes is not None:
            cells = np.argwhere(routes.is_passed) + np.array(routes.lower)
            return SubMapRoutes(transform_from(pose, cells * node.cell_m), node.cell_m)

    return None


def _sub_maps_around(graph: Graph, ends_m: Floats) -> list[Map]:
    """Return the sub-maps with places whose area has all of (n, 2) positions in it, the largest
    first.
    """
    maps = with_places(graph, graph.cycle)
    if not maps:
        return []

    poses = np.array([pose_of(node) for node in maps])
    halves_m = np.array([(node.width_m, node.height_m) for node in maps]) / 2
    own_m = transform_to(poses[:, None], ends_m)
    is_around = (np.abs(own_m) <= halves_m[:, None]).all(axis=(1, 2))

    around = [maps[number] for number in np.flatnonzero(is_around).tolist()]
    return sorted(around, key=lambda node: -node.width_m * node.height_m)


def _outside_m(node: Map, ends_m: Floats) -> Floats:
    """Return the (n, n) lengths that a route between each two of (n, 2) positions has at least if
    it leaves a sub-map: those of the straight line to the other's mirror image beyond the border.
    """
    shortest_m = np.full((len(ends_m), len(ends_m)), np.inf)
    for axis, side_m in enumerate((node.width_m, node.height_m)):
        for border_m in (-side_m / 2, side_m / 2):
            mirrored_m = ends_m.copy()
            mirrored_m[:, axis] = 2 * border_m - mirrored_m[:, axis]
            lines_m = ends_m[:, None] - mirrored_m
            shortest_m = np.minimum(shortest_m, np.hypot(lines_m[..., 0], lines_m[..., 1]))

    return shortest_m
