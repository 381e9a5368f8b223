"""Observations and closures of places that were joined into older ones: they are of these then.

Pure.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence

import msgspec
import numpy as np

from cogmap.estimation.pairwise_consistency import Views
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import transform_from
from cogmap.graph.graph import Graph
from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import DropNode, Operation
from cogmap.schemas.nodes import (
    LinkKind,
    LoopClosure,
    ObservationColumn,
    Observations,
    RangeColumn,
    observations_id,
)
from cogmap.services.codelets.correction.joining import JOIN_SD_M, Joining
from cogmap.services.codelets.mapping.observations import DIRECTION, SPREAD, WHERE
from cogmap.services.codelets.mapping.path import STAMP, links_of
from cogmap.services.codelets.nodes import nodes_of


def observations_left(
    graph: Graph, segment: str, joined: Joining, numbers: Indices
) -> list[Operation]:
    """Move the observations from the joined places of the path segment of that id to the known
    places, in the segments `numbers`, (k,); the others stay. A place keeps its first observation of
    each landmark.
    """
    operations: list[Operation] = []
    moved: defaultdict[tuple[int, str], list[Floats]] = defaultdict(list)
    names = sorted(graph.links.sources(segment, LinkKind.ALONG))
    for node in nodes_of(graph, Observations, names):
        rows = node.rows.numpy()
        place = joined.places[:, STAMP].searchsorted(rows[:, ObservationColumn.STAMP_S])
        stays = joined.stays[place]
        ranges_left = _ranges_left(node, joined)
        if stays.all() and ranges_left == node.ranges:
            continue

        if stays.any() or ranges_left is not None:
            left = msgspec.structs.replace(node, rows=Matrix.of(rows[stays]), ranges=ranges_left)
            operations.append(left)
        else:
            operations.append(DropNode(id=node.id))

        # Seen from what the joined places become.
        there = place[~stays]
        offsets = joined.offsets[there]
        gone = rows[~stays]
        gone[:, ObservationColumn.STAMP_S] = joined.stamps_s[there]
        gone[:, WHERE] = transform_from(offsets, gone[:, WHERE])
        gone[:, SPREAD] = np.hypot(gone[:, SPREAD], JOIN_SD_M)
        gone[:, DIRECTION] += offsets[:, 2]
        for number, row in zip(numbers[joined.into[there]].tolist(), gone, strict=True):
            moved[number, node.landmark].append(row)

    for (number, landmark), added in sorted(moved.items()):
        rows = np.array(added)
        before = graph.get(Observations, observations_id(number, landmark))
        if before is not None:
            rows = np.vstack([before.rows.numpy(), rows])

        _, first = np.unique(rows[:, ObservationColumn.STAMP_S], return_index=True)
        if before is not None and len(first) == len(before.rows.numpy()):
            continue

        after = Observations(
            id=observations_id(number, landmark),
            base_level=1.0,
            number=number,
            landmark=landmark,
            rows=Matrix.of(rows[first]),
            ranges=None if before is None else before.ranges,
        )
        operations.append(after)
        if before is None:
            operations += links_of(after)

    return operations


def _ranges_left(node: Observations, joined: Joining) -> Matrix | None:
    """Return the ranges alone that are from places which stay: a landmark is heard along the whole
    path, so that those from the joined places are not missed.
    """
    if node.ranges is None:
        return None

    ranges = node.ranges.numpy()
    place = joined.places[:, STAMP].searchsorted(ranges[:, RangeColumn.STAMP_S])
    left = ranges[joined.stays[place]]
    return Matrix.of(left) if len(left) else None


def closures_left(closures: Sequence[LoopClosure], ends: Views, joined: Joining) -> list[Operation]:
    """Return what becomes of loop closures, given the places of their `ends`, counted from the
    first of the joined ones on.

    Of the closures to these places, those are left that were accepted and lead to a place that
    stays. A closure from a joined place becomes one from what that place becomes.
    """
    count = len(joined.into)
    offsets = joined.offsets
    operations: list[Operation] = []
    for closure, i, j in zip(closures, ends.i.tolist(), ends.j.tolist(), strict=True):
        is_settled = 0 <= j < count
        if is_settled and not (joined.stays[j] and closure.accepted):
            operations.append(DropNode(id=closure.id))
        elif 0 <= i < count and not joined.stays[i]:
            if closure.sd_rad:
                # It is by a place, and states that the headings are equal.
                operations.append(DropNode(id=closure.id))
                continue

            there_m = transform_from(offsets[i], np.array([closure.ahead_m, closure.left_m]))
            ahead_m, left_m = there_m.tolist()
            after = msgspec.structs.replace(
                closure,
                from_ns=round(float(joined.stamps_s[i]) * 1e9),
                ahead_m=ahead_m,
                left_m=left_m,
                sd_m=math.hypot(closure.sd_m, JOIN_SD_M),
            )
            operations.append(after)

    return operations
