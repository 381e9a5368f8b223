"""The frame, the area and the grid of a sub-map, by where its objects are."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import ROOT_MAP, Map, Object, map_id
from cogmap.services.codelets.sub_maps.members import positions_of

# Of a sub-map with one object, or with objects in a row: a cell of the root map.
MIN_SIDE_M = 1.0
# A sub-map is sorted anew when its objects have moved its border by more.
MOVED_M = 5.0
# The place nodes that the grid of a sub-map has about, by which it is fine or coarse.
PLACES = 1600
COARSEST = 4
"""The cells of a sub-map are at most 2^COARSEST times coarser than the root map's; finer ones would
know no more than those.
"""


class Area(NamedTuple):
    """The middle of a rectangle in the root map's frame, and its sides."""

    x_m: float
    y_m: float
    width_m: float
    height_m: float

    def differs_from(self, node: Map, tolerance_m: float) -> bool:
        """Return whether any border is farther than `tolerance_m` from that of a sub-map."""
        sides_m = (self.width_m - node.width_m) / 2, (self.height_m - node.height_m) / 2
        middle_m = self.x_m - node.x_m, self.y_m - node.y_m
        for moved_m, grown_m in zip(middle_m, sides_m, strict=True):
            if abs(moved_m) + abs(grown_m) > tolerance_m:
                return True

        return False


def area_covered(positions_m: Floats) -> Area:
    """Return what (n, 2) positions cover."""
    low_m = positions_m.min(axis=0)
    high_m = positions_m.max(axis=0)
    x_m, y_m = ((low_m + high_m) / 2).tolist()
    width_m, height_m = (high_m - low_m).tolist()
    return Area(x_m, y_m, max(MIN_SIDE_M, width_m), max(MIN_SIDE_M, height_m))


def is_outdated(node: Map, members: Mapping[int, Sequence[Object]]) -> bool:
    """Return whether a sub-map has lost its objects, or they cover another area by now."""
    (objects,) = members.values()
    if not objects:
        return True

    return area_covered(positions_of(objects)).differs_from(node, MOVED_M)


def sub_map_node(number: int, area: Area, graph: Graph) -> Map:
    """Make the node of a sub-map. The larger its area, the coarser its grid (paper §5.3)."""
    root_cell_m = graph.cell_m(ROOT_MAP)
    area_m2 = area.width_m * area.height_m
    wanted_m = math.sqrt(area_m2 / PLACES)

    # Powers of two, so that a grid stays as it is while its sub-map grows a little.
    steps = round(math.log2(wanted_m / root_cell_m))
    cell_m = root_cell_m * 2.0 ** min(max(steps, 0), COARSEST)
    return Map(
        id=map_id(number),
        base_level=1.0,
        cycle=graph.cycle,
        cell_m=cell_m,
        parent=ROOT_MAP,
        x_m=area.x_m,
        y_m=area.y_m,
        width_m=area.width_m,
        height_m=area.height_m,
    )
