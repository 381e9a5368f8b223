"""The objects of a recalled map on the root map: those that are known here already, and new ones.
Pure.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import is_same, names_of_both
from cogmap.schemas.graph import Link, Operation
from cogmap.schemas.nodes import (
    NEVER_NS,
    ROOT_MAP,
    LinkKind,
    Object,
    RecalledColumn,
    Recollection,
    individual_label,
    nearest_place,
    object_id,
)

ORIGIN = "recalled"


def _recalled(recalled: Recollection, number: int) -> Object:
    """Return one of the recalled objects as it was, in the recalled map's frame."""
    row = recalled.objects.numpy()[number].tolist()
    sightings = int(row[RecalledColumn.SIGHTINGS])
    label = recalled.labels[number]
    return Object(
        id=object_id(label),
        label=label,
        names={recalled.names[number]: float(max(1, sightings))},
        given_name=recalled.given_names[number],
        function=recalled.functions[number],
        x_m=row[RecalledColumn.X_M],
        y_m=row[RecalledColumn.Y_M],
        x_sd_m=row[RecalledColumn.X_SD_M],
        y_sd_m=row[RecalledColumn.Y_SD_M],
        width_m=row[RecalledColumn.WIDTH_M],
        height_m=row[RecalledColumn.HEIGHT_M],
        sightings=sightings,
        last_seen_ns=NEVER_NS,
    )


def recalled_objects(recalled: Recollection, graph: Graph, pose: Floats) -> list[Operation]:
    """Add the recalled objects where they stand in the recalled map's frame, in which the root
    map's has that `pose`. One that is known here keeps its label; others get one that is free.
    """
    known = [node for node in graph.of_kind(Object) if node.map == ROOT_MAP]
    positions_m = np.array([(node.x_m, node.y_m) for node in known]).reshape(-1, 2)
    here_m = transform_from(pose, positions_m).tolist()

    # The label here of each: the one it is matched with, or that of the nearest object of its look
    # that stands there too; empty if there is none.
    matched = {label for label in recalled.matched if label}
    labels = []
    for number, match in enumerate(recalled.matched):
        label = match
        there = _recalled(recalled, number)
        at_m = (there.x_m, there.y_m)
        nearest_m = math.inf
        candidates = () if match else zip(known, here_m, strict=True)
        for other, there_m in candidates:
            away_m = math.dist(there_m, at_m)
            moved = msgspec.structs.replace(other, x_m=there_m[0], y_m=there_m[1])
            is_it = other.label not in matched and is_same(moved, there)
            if is_it and away_m <= nearest_m:
                label = other.label
                nearest_m = away_m

        matched.add(label)
        labels.append(label)

    node_of = {node.label: node for node in known}
    operations: list[Operation] = []
    for number, label in enumerate(labels):
        there = _recalled(recalled, number)
        own = label or individual_label(graph.cycle, number, ORIGIN)

        # It is as it was recalled, with what was learned of it in this run.
        node = msgspec.structs.replace(
            there,
            id=object_id(own),
            label=own,
            base_level=1.0,
            cycle=graph.cycle,
        )
        here = node_of.get(own)
        if here is not None:
            node = msgspec.structs.replace(
                here,
                names=names_of_both(there, here),
                given_name=here.given_name or there.given_name,
                base_level=1.0,
                cycle=graph.cycle,
                function=there.function or here.function,
                x_m=there.x_m,
                y_m=there.y_m,
                x_sd_m=there.x_sd_m,
                y_sd_m=there.y_sd_m,
                width_m=there.width_m,
                height_m=there.height_m,
                sightings=here.sightings + there.sightings,
                offsets_m=None,
            )
        place = nearest_place(node.x_m, node.y_m, graph.cell_m(ROOT_MAP))
        operations += [node, Link(source=node.id, target=place, kind=LinkKind.AT)]

    return operations
