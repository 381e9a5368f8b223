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
    observations_id,
)
from cogmap.services.codelets.correction.joining import JOIN_SD_M, Joining
from cogmap.services.codelets.mapping.observations import DIRECTION, SPREAD, WHERE
from cogmap.services.codelets.mapping.path import STAMP, links_of
from cogmap.services.codelets.nodes import nodes_of


def observations_left(
    graph: Graph, segment: str, joined: Joining, numbers: Indices
) -> list[Operation]:
    """The observations along the path segment of that id without those from its joined places,
    which are from the known places then, (k,) `numbers` being the segments of these. A place keeps
    its first observation of each landmark.
    """
    operations: list[Operation] = []
    moved: defaultdict[tuple[int, str], list[Floats]] = defaultdict(list)
    for node in _observations_along(graph, segment):
        rows = node.rows.numpy()
        place = joined.places[:, STAMP].searchsorted(rows[:, ObservationColumn.STAMP_S])
        stays = joined.stays[place]
        if stays.all():
            continue

        operations.append(_with_rows(node, rows[stays]))
        numbers_there = numbers[joined.into[place[~stays]]]
        for number, row in zip(numbers_there.tolist(), _moved(rows, place, joined), strict=True):
            moved[number, node.landmark].append(row)

    for (number, landmark), added in sorted(moved.items()):
        operations += _added(graph, number, landmark, np.array(added))
    return operations


def closures_left(closures: Sequence[LoopClosure], ends: Views, joined: Joining) -> list[Operation]:
    """What becomes of loop closures, the places of whose `ends` are counted from the first of the
    joined ones on.

    Of those to these places the accepted ones to places that stay are left. Those from a joined
    place are from what that becomes.
    """
    count = len(joined.into)
    offsets = joined.offsets
    operations: list[Operation] = []
    for closure, i, j in zip(closures, ends.i.tolist(), ends.j.tolist(), strict=True):
        is_settled = 0 <= j < count
        if is_settled and not (joined.stays[j] and closure.accepted):
            operations.append(DropNode(id=closure.id))
        elif 0 <= i < count and not joined.stays[i]:
            operations.append(_from(closure, float(joined.stamps_s[i]), offsets[i]))

    return operations


def _observations_along(graph: Graph, segment: str) -> list[Observations]:
    names = sorted(graph.links.sources(segment, LinkKind.ALONG))
    return nodes_of(graph, Observations, names)


def _with_rows(node: Observations, rows: Floats) -> Operation:
    """Observations with other (n, 6) rows; they are dropped where there are none."""
    if not len(rows):
        return DropNode(id=node.id)
    return msgspec.structs.replace(node, rows=Matrix.of(rows))


def _moved(rows: Floats, place: Indices, joined: Joining) -> Floats:
    """(m, 6): those of (n, 6) observations that are from joined places, by (n,) `place`, from what
    these become.
    """
    is_moved = ~joined.stays[place]
    there = place[is_moved]
    offsets = joined.offsets[there]

    moved = rows[is_moved]
    moved[:, ObservationColumn.STAMP_S] = joined.stamps_s[there]
    moved[:, WHERE] = transform_from(offsets, moved[:, WHERE])
    moved[:, SPREAD] = np.hypot(moved[:, SPREAD], JOIN_SD_M)
    moved[:, DIRECTION] += offsets[:, 2]
    return moved


def _added(graph: Graph, number: int, landmark: str, rows: Floats) -> list[Operation]:
    """The observations of a landmark along segment `number` with those of (n, 6) `rows` that are
    from places which it was not observed from.
    """
    before = graph.get(Observations, observations_id(number, landmark))
    if before is not None:
        rows = np.vstack([before.rows.numpy(), rows])

    _, first = np.unique(rows[:, ObservationColumn.STAMP_S], return_index=True)
    if before is not None and len(first) == len(before.rows.numpy()):
        return []

    after = Observations(
        id=observations_id(number, landmark),
        base_level=1.0,
        number=number,
        landmark=landmark,
        rows=Matrix.of(rows[first]),
    )
    return [after] if before is not None else [after, *links_of(after)]


def _from(closure: LoopClosure, stamp_s: float, offset: Floats) -> Operation:
    """A closure that leads from the place at `stamp_s`, in whose frame the one before has the pose
    `offset` (3,). One that is by a place is dropped, as it states that the headings are equal.
    """
    if closure.sd_rad:
        return DropNode(id=closure.id)

    there_m = transform_from(offset, np.array([closure.ahead_m, closure.left_m]))
    ahead_m, left_m = there_m.tolist()
    return msgspec.structs.replace(
        closure,
        from_ns=round(stamp_s * 1e9),
        ahead_m=ahead_m,
        left_m=left_m,
        sd_m=math.hypot(closure.sd_m, JOIN_SD_M),
    )
