"""The objects of a recalled map on the root map: those that are known here already, and new ones.
Pure.
"""

from __future__ import annotations

import itertools
import math

import msgspec
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import APART_M
from cogmap.schemas.graph import Link, Operation
from cogmap.schemas.nodes import (
    NEVER_NS,
    ROOT_MAP,
    LinkKind,
    Object,
    RecalledColumn,
    Recollection,
    individual_label,
    look_of,
    nearest_place,
    object_id,
)

POSITION = slice(RecalledColumn.X_M, RecalledColumn.Y_M + 1)


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
        look = look_of(recalled.labels[number])
        at_m = recalled.objects.numpy()[number, POSITION]
        nearest_m = APART_M
        candidates = () if match else zip(known, here_m, strict=True)
        for node, there_m in candidates:
            away_m = math.dist(there_m, at_m)
            is_free = look_of(node.label) == look and node.label not in matched
            if is_free and away_m <= nearest_m:
                label = node.label
                nearest_m = away_m

        matched.add(label)
        labels.append(label)

    node_of = {node.label: node for node in known}
    taken = set(node_of) | {label for label in labels if label}

    operations: list[Operation] = []
    for number, label in enumerate(labels):
        own = label
        if not own:
            look = look_of(recalled.labels[number])
            names = (individual_label(look, each) for each in itertools.count(1))
            own = next(name for name in names if name not in taken)

        taken.add(own)
        row = recalled.objects.numpy()[number].tolist()
        here = node_of.get(own)
        if here is None:
            here = Object(id=object_id(own), label=own, x_m=0.0, y_m=0.0, last_seen_ns=NEVER_NS)

        # It is as it was recalled, with what was learned of it in this run.
        node = msgspec.structs.replace(
            here,
            base_level=1.0,
            cycle=graph.cycle,
            function=recalled.functions[number] or here.function,
            x_m=row[RecalledColumn.X_M],
            y_m=row[RecalledColumn.Y_M],
            x_sd_m=row[RecalledColumn.X_SD_M],
            y_sd_m=row[RecalledColumn.Y_SD_M],
            width_m=row[RecalledColumn.WIDTH_M],
            height_m=row[RecalledColumn.HEIGHT_M],
            sightings=here.sightings + int(row[RecalledColumn.SIGHTINGS]),
            offsets_m=None,
        )
        place = nearest_place(node.x_m, node.y_m, graph.cell_m(ROOT_MAP))
        operations += [node, Link(source=node.id, target=place, kind=LinkKind.AT)]

    return operations
