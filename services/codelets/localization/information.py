"""How much a view of a landmark informs: less, the less has happened since the landmark was placed.

A landmark was placed from where the agent took itself to be, and shares the error of that. It can
correct only the error that came since; taken for independent, it would pull the agent after its own
mistakes. (In a filter of the joint state their correlation does this.)

Neither is a view new that is from where the view before was: it errs as that did, since it shows
the same walls, as far away.
"""

from __future__ import annotations

import math
import struct
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import NEVER_NS, Object, PathColumn, PathSegment, object_id
from cogmap.services.codelets.localization.measurement_model import Measurements
from cogmap.services.codelets.localization.sampling import centred

VARIANCES = slice(PathColumn.VARIANCE_M2, PathColumn.VARIANCE_RAD2 + 1)
INDEPENDENT_RAD = 0.2
"""Change of viewpoint, way over distance, after which a view of a building errs independently: of
11,000 percepts in three towns of buildings never taught, errors of the same building correlate by
0.45 from nearly the same viewpoint, and by 0.3 then. In other drives through these towns objects
err by 1.16 m with it, by 1.20 with 0.35."""

AROUND_RAD = 2 * math.pi
"""Change of viewpoint after which a building informs the agent anew: it stands where all that was
seen of it says, so that its own error is the same from all round."""

MIN_DISTANCE_M = 0.1
"""Nothing is seen from nearer; a change of viewpoint stays defined."""

STAMP_FORMAT = struct.Struct("<d")
STAMP_OFFSET = PathColumn.STAMP_S * STAMP_FORMAT.size


def new_share(samples: Floats, seen: Measurements, since: Floats) -> Floats:
    """Compute the share, 0 to 1, of the uncertainty of (n, 7) samples' position that came since
    each landmark was placed, (k,). `since` (k, 2) states how much path integration's variances, in
    m^2 and rad^2, have grown since then.
    """
    _, deviations = centred(samples[:, :2])
    variances_m2 = np.square(deviations).mean(axis=0)
    position_m2 = max(float(variances_m2.sum()), 1e-9)

    since_m2, since_rad2 = since.T
    by_turns_m2 = since_rad2 * seen.range_m**2
    share: Floats = (2 * since_m2 + by_turns_m2) / position_m2
    return share.clip(0.0, 1.0)


def new_view_share(landmark: Object, agent_m: Floats, independent_rad: float) -> float:
    """Compute the share, 0 to 1, of a view of a landmark from (2,) that the last view of it has not
    told: the way between both over the distance, of `independent_rad`, after which they err
    independently.
    """
    if landmark.seen_from_m is None:
        return 1.0

    from_m = agent_m - (landmark.x_m, landmark.y_m)
    way_m = math.dist(from_m, landmark.seen_from_m)
    distance_m = max(math.hypot(*from_m), MIN_DISTANCE_M)
    return min(1.0, way_m / distance_m / independent_rad)


def variances_when_placed(graph: Graph, seen: Measurements) -> Floats:
    """Return path integration's variances when each landmark in view was placed, (k, 2)."""
    path = graph.path
    variances = []
    for label in seen.labels:
        landmark = graph.get(Object, object_id(label))
        created_ns = NEVER_NS if landmark is None else landmark.created_ns
        variances.append(variances_at(path, created_ns))

    return np.array(variances)


def variances_at(path: Sequence[PathSegment], stamp_ns: int) -> tuple[float, float]:
    """Find path integration's variances, in m^2 and rad^2, at the place of a `path` at `stamp_ns`,
    or the next before it; -inf each before the path begins. The oldest segment comes first.
    """

    def begin_s(segment: PathSegment) -> float:
        # Without decoding the rows, which is most of a search's time.
        return float(STAMP_FORMAT.unpack_from(segment.rows.data, STAMP_OFFSET)[0])

    stamp_s = stamp_ns * 1e-9
    index = bisect_right(path, stamp_s, key=begin_s) - 1
    if index < 0:
        return -math.inf, -math.inf

    rows = path[index].rows.numpy()
    following = int(rows[:, PathColumn.STAMP_S].searchsorted(stamp_s, side="right"))
    variance_m2, variance_rad2 = rows[following - 1, VARIANCES].tolist()
    return variance_m2, variance_rad2
