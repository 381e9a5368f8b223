"""When the map is corrected: by closures, enough of which are there to agree, or by points, as the
path along which they are seen grows.
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from cogmap.estimation.pairwise_consistency import MIN_AGREEING
from cogmap.estimation.pose_graph import mahalanobis2, residuals
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.runtime.codelet import CycleContext
from cogmap.schemas.nodes import LoopClosure, PathSegment
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.mapping.observations import SAME_PLACE_S
from cogmap.services.codelets.mapping.path import POSE, ROWS, STAMP, objects_along
from cogmap.services.codelets.mapping.views import constraints_of, views_of

# Places of the path, 1 m apart, that a loop has at least.
MIN_ROWS = 10
# A path of so many segments, half a kilometre, is corrected as often as closures come.
SHORT_SEGMENTS = 8
# A loop closure is rejected if a true one would misfit as much with a smaller probability.
FALSE_CLOSURE = 1e-3
# The path explains a closure whose misfit is at most this share of that at which it is rejected.
EXPLAINED_MISFIT = 0.1
# The path is corrected from this share of new closures on that it does not explain.
UNEXPLAINED_SHARE = 0.1
# Places of a short path after which the points seen along it correct it: between 3 and 10, which
# were tried on robot 1 of MRCLAM's sixth set.
GROWN_PLACES = 5


def closures_due(context: CycleContext, graph: Graph, config: Config) -> list[LoopClosure]:
    """Return the closures that are to be judged now: those of the present pass that were not, if
    enough of it are there to agree; unless some were judged just now, or the path, part of which is
    sparse, explains them. If one sighting closes a loop, there are some at once.
    """
    closures = list(graph.of_kind(LoopClosure))
    unjudged = [closure for closure in closures if closure.accepted is None]
    is_sighted = any(not closure.range_alone for closure in unjudged)
    if config.closes_by == "sighting" and is_sighted:
        return unjudged

    since_ns = context.stamp_ns - config.revisit_s * 1e9
    late = [closure for closure in closures if closure.to_ns > since_ns]
    fresh = [closure for closure in late if closure.accepted is None]
    is_heard = any(closure.range_alone for closure in fresh)
    if not fresh or (len(late) < MIN_AGREEING and not is_heard):
        return []

    # Correcting a path takes as long as it is, so it is done as much less often: it takes the same
    # share of a long drive as of a short one.
    judged_ns = [closure.to_ns for closure in closures if closure.accepted is not None]
    length = max(1.0, graph.count(PathSegment) / SHORT_SEGMENTS)
    spacing_ns = config.closure_spacing_s * length * 1e9
    if judged_ns and context.stamp_ns < max(judged_ns) + spacing_ns:
        return []

    path = graph.path
    is_corrected = any(closure.accepted for closure in closures)
    is_long = any(segment.is_sparse for segment in path)
    if is_corrected and is_long and not is_heard and _may_be_deferred(fresh, rows_of(path)):
        return []

    return fresh


def grown_segment(context: CycleContext, graph: Graph) -> list[str]:
    """Return the path's last segment if the place that the path has gained in this cycle is the
    last of GROWN_PLACES, or of as many more as the path is longer than a short one.
    """
    last = graph.last_segment
    if last is None:
        return []

    rows = last.rows.numpy()
    is_new = abs(context.stamp_ns * 1e-9 - float(rows[-1, STAMP])) < SAME_PLACE_S
    places = last.number * ROWS + len(rows)
    length = max(1, graph.count(PathSegment) // SHORT_SEGMENTS)
    is_whole = places >= MIN_ROWS and places % (GROWN_PLACES * length) == 0
    return [last.id] if is_new and is_whole else []


def is_bound_by_points(graph: Graph, config: Config) -> bool:
    """Return whether sightings along the path's last segment bind it though no loop closes: each
    sighting of a point errs by itself. Those of a building's side err alike, and bind one pass to
    the next alone.

    The points must have been seen in a direction, and have names: of others, which is which may be
    mistaken. If some were on the map before the path began, surveyed or remembered, the agent has
    its place from the map, which stays.
    """
    is_ours = config.closes_by == "agreement" and config.correct == "heading"
    last = graph.last_segment
    if last is None or not is_ours or config.landmarks != "points":
        return False

    seen = objects_along(graph, last)
    began_ns = graph.path[0].rows.numpy()[0, STAMP] * 1e9
    is_given = any(landmark.created_ns < began_ns for _, landmark in seen)
    is_bound = any(
        any(landmark.names) and len(observations.rows.numpy()) for observations, landmark in seen
    )
    return is_bound and not is_given


def _may_be_deferred(closures: list[LoopClosure], rows: Floats) -> bool:
    """Return whether the path `rows`, as it is believed, explains all but a share of the closures,
    or all but so few that they close no loop.
    """
    poses = rows[:, POSE]
    views = views_of([each for each in closures if not each.range_alone], rows)
    constraints = constraints_of(views, poses)
    squared = mahalanobis2(residuals(poses, constraints), constraints.information)

    degrees = np.where(views.has_heading, 3, 2)
    misfit = squared / chdtri(degrees, FALSE_CLOSURE)
    unexplained = int((misfit > EXPLAINED_MISFIT).sum())
    return unexplained < max(MIN_AGREEING, UNEXPLAINED_SHARE * len(closures))
