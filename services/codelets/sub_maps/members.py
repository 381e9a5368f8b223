"""The sub-maps of the graph, and the objects in them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import ROOT_MAP, LinkKind, Map, Object, map_number
from cogmap.services.codelets.nodes import nodes_of


def sub_maps_of(graph: Graph) -> list[Map]:
    """Return the sub-maps of the root map, by number."""
    maps = filter(is_sub_map, graph.of_kind(Map))
    return sorted(maps, key=number_of)


def is_sub_map(node: Map) -> bool:
    """Return whether a map is a sub-map of the root map."""
    return node.parent == ROOT_MAP and map_number(node.id) is not None


def number_of(node: Map) -> int:
    """Return the number of a sub-map."""
    return map_number(node.id) or 0


def next_number(graph: Graph) -> int:
    """Return the number of the next sub-map: one more than that of any map."""
    numbers = [number_of(node) for node in graph.of_kind(Map)]
    return max(numbers, default=0) + 1


def members_of(maps: Iterable[Map], graph: Graph) -> dict[int, list[Object]]:
    """Return the objects of each sub-map, by its number, in the order of their ids."""
    members = {}
    for node in maps:
        names = sorted(graph.links.sources(node.id, LinkKind.WITHIN))
        members[number_of(node)] = nodes_of(graph, Object, names)

    return members


def maps_around(
    maps: Sequence[Map], new: Sequence[Object], moved: Sequence[Map], reach_m: float
) -> list[Map]:
    """Find the sub-maps that a new object may join or change, and those that have moved with their
    neighbours: all within `reach_m`.
    """
    if not maps:
        return []

    low_m, high_m = _boxes(maps)
    is_near = np.zeros(len(maps), bool)
    for position_m in positions_of(new):
        is_near |= _distances_m(low_m, high_m, position_m, position_m) <= reach_m

    if moved:
        for low, high in zip(*_boxes(moved), strict=True):
            is_near |= _distances_m(low_m, high_m, low, high) <= reach_m

    return [node for node, near in zip(maps, is_near.tolist(), strict=True) if near]


def positions_of(objects: Iterable[Object]) -> Floats:
    """Return the positions of objects, (n, 2)."""
    positions_m = [(node.x_m, node.y_m) for node in objects]
    return np.array(positions_m, np.float64).reshape(-1, 2)


def pose_of(node: Map) -> Floats:
    """Return the pose of a sub-map's frame in that of its parent, (3,)."""
    return np.array([node.x_m, node.y_m, node.heading_rad])


def _boxes(maps: Sequence[Map]) -> tuple[Floats, Floats]:
    """Return the lower and upper corners of sub-maps, (k, 2) each."""
    centres_m = np.array([(node.x_m, node.y_m) for node in maps])
    halves_m = np.array([(node.width_m, node.height_m) for node in maps]) / 2
    return centres_m - halves_m, centres_m + halves_m


def _distances_m(low_m: Floats, high_m: Floats, low: Floats, high: Floats) -> Floats:
    """Compute the distances of boxes from another box, (k,)."""
    gaps_m = np.maximum(low_m - high, low - high_m).clip(0.0)
    distances_m: Floats = np.hypot(gaps_m[:, 0], gaps_m[:, 1])
    return distances_m
