"""The sub-maps of a recalled map on the root map, under the numbers that they have had. Pure."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose
from cogmap.graph.graph import Graph
from cogmap.schemas.graph import DropNode, Links, Operation
from cogmap.schemas.nodes import LinkKind, Map, Object, Recollection, map_id
from cogmap.services.codelets.sub_maps.members import next_number, sub_maps_of


def recalled_sub_maps(
    recalled: Recollection, objects: Sequence[Object], graph: Graph, pose: Floats
) -> list[Operation]:
    """Add the recalled map's sub-maps with their objects, which are `objects` here, in the same
    order; in the recalled map's frame, the root map's has that `pose`.

    Sub-maps that this run has found keep the objects that were not recalled, under a number that is
    free.
    """
    if not recalled.sub_maps:
        return []

    here = dict(zip(recalled.labels, objects, strict=True))
    maps: list[Operation] = []
    within = {}
    for each in recalled.sub_maps:
        node = Map(
            id=map_id(each.number),
            base_level=1.0,
            cycle=graph.cycle,
            cell_m=each.cell_m,
            parent=map_id(each.parent),
            x_m=each.x_m,
            y_m=each.y_m,
            heading_rad=each.heading_rad,
            width_m=each.width_m,
            height_m=each.height_m,
        )
        maps.append(node)
        for label in each.members:
            if label in here:
                within[here[label].id] = map_id(each.number)

    before = sub_maps_of(graph)
    number = max(next_number(graph), 1 + max(each.number for each in recalled.sub_maps))
    for node in before:
        left = [
            name for name in graph.links.sources(node.id, LinkKind.WITHIN) if name not in within
        ]
        if left:
            frame = compose(pose, np.array([node.x_m, node.y_m, node.heading_rad]))
            x_m, y_m, heading_rad = frame.tolist()
            renumbered = msgspec.structs.replace(
                node, id=map_id(number), x_m=x_m, y_m=y_m, heading_rad=heading_rad
            )
            maps.append(renumbered)
            within |= dict.fromkeys(left, map_id(number))
            number += 1

    weights = {name: {target: 1.0} for name, target in sorted(within.items())}
    gone = [DropNode(id=node.id) for node in before]
    return [*gone, *maps, Links(kind=LinkKind.WITHIN, weights=weights)]
