"""A cue to a stored map: what was passed on the way here is what it has along that way. Pure.

Objects here that stand as on a stored map say nothing of what that map has and is not here. Along
the way that was driven, all that it has must have been seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.polylines import distances_along
from cogmap.geometry.se2 import transform_from
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import Object, PathColumn
from cogmap.services.memory.maps import RememberedMap

SEGMENTS = 3
"""The way is that of the last segments of the path, 130 m at least where it is as long."""

BESIDE_M = 12.0
"""What stands farther beside the way may be hidden by what is nearer."""

ENDS_M = 4.0
"""What is nearest to the way so near to an end of it was not passed, or only in part."""

MIN_PASSED = 4
"""Objects that a stored map must have along the way; chosen by `benchmarks memory`."""

MIN_SHARE = 0.75
"""Share of the objects of one map, where the other is known, that must stand as on it; if the match
is wrong half of them do.
"""

MATCH_WITHIN_M = 2.5
"""Distance within which an object stands as on a stored map."""

POSITION = slice(PathColumn.X_M, PathColumn.Y_M + 1)


class Way(NamedTuple):
    """Places of the agent's path, (k, 2), the oldest first, and the objects that it has learned."""

    at_m: Floats
    learned: Sequence[Object]


def way_of(graph: Graph, learned: Sequence[Object]) -> Way:
    """Return the agent's way, as far back as the last segments of its path."""
    rows = [np.zeros((0, len(PathColumn)))]
    for segment in graph.path[-SEGMENTS:]:
        rows.append(np.asarray(segment.rows.numpy(), np.float64))

    return Way(np.vstack(rows)[:, POSITION], learned)


def is_as_passed(way: Way, remembered: RememberedMap, pose: Floats) -> bool:
    """Decide whether enough objects of a stored map are along the way, and enough of them are known
    here. The frame here has that `pose` in the map's.
    """
    along = _along(transform_from(pose, way.at_m), remembered.at_m)
    if len(along) < MIN_PASSED:
        return False

    here_m = transform_from(pose, np.array([(node.x_m, node.y_m) for node in way.learned]))
    looks_here = np.array([node.look for node in way.learned])
    looks_there = remembered.looks

    known = 0
    for number in along.tolist():
        away_m = np.hypot(*(here_m - remembered.at_m[number]).T)
        is_it = (away_m <= MATCH_WITHIN_M) & (looks_here == looks_there[number])
        known += bool(is_it.any())

    return known >= MIN_SHARE * len(along)


def _along(way_m: Floats, at_m: Floats) -> Indices:
    """Find the numbers of the objects, (n, 2), that were passed on a way, (k, 2); (m,)."""
    if len(way_m) < 2:
        return np.zeros(0, np.int64)

    driven_m = distances_along(way_m)
    offsets_m = at_m[:, None] - way_m
    apart_m = np.hypot(offsets_m[..., 0], offsets_m[..., 1])

    nearest_m = driven_m[apart_m.argmin(axis=1)]
    is_between = (nearest_m >= ENDS_M) & (nearest_m <= driven_m[-1] - ENDS_M)
    return np.flatnonzero(is_between & (apart_m.min(axis=1) <= BESIDE_M))
