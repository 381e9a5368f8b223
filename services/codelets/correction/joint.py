"""The path optimized together with the landmarks seen along it (beyond the paper)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import PoseGraph
from cogmap.estimation.windings import optimize_windings
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import FULL_TURN_RAD
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.mapping.observations import Sightings
from cogmap.services.codelets.mapping.ranges import Landmarks, Ranges

# Times that sightings are weighed anew by the path that is found: each solves the whole path.
ROUNDS = 5
# Sides of a building whose views share an error: measured over three laps of towns 1 to 3.
SIDES = 16


def optimize_jointly(
    graph: PoseGraph, seen: Sightings, heard: Ranges, config: Config
) -> tuple[Floats, int]:
    """Close the loops of `graph`, and bind its poses to what was seen along the path, and to what
    was heard at a range alone. Return the (n, 3) poses, and how often the whole path was solved for
    that.

    Where a landmark seems to be depends on the side that it is seen from: of a building the front
    is measured, and its depth assumed. So each of its sides is taken for a landmark of its own,
    which binds one pass to the next past the same side, and bends neither. Points have one side.

    `seen` are sightings of landmarks whose extent is known: the part that shows at the view's
    border, of one whose size nobody knows, moves with the agent, and would bend the path.
    """
    # Ranges are led from what is believed, which they have corrected before: each correction begins
    # where the last one ended. So are points along a path without a loop, which path integration
    # alone would lead into another minimum.
    is_heard_alone = len(heard.place) > 0 and not len(seen.place)
    is_open = config.landmarks == "points" and not len(graph.closures.i)
    poses = graph.poses if is_heard_alone or is_open else optimize_windings(graph)
    if not len(seen.place) and not is_heard_alone:
        return poses, 1

    sides = by_side(seen, poses, 1 if config.landmarks == "points" else SIDES)
    landmarks_m = sides.landmarks_m(poses)
    for _ in range(ROUNDS):
        path = replace(graph, poses=poses)
        joint = with_landmarks(path, sides, landmarks_m)
        joint = with_ranges(joint, heard, heard.landmarks(poses))
        optimized = optimize(joint)
        landmarks_m = optimized[len(poses) : len(poses) + len(landmarks_m), :2]
        poses = optimized[: len(poses)]

    return poses, 1 + ROUNDS


def with_ranges(graph: PoseGraph, heard: Ranges, found: Landmarks) -> PoseGraph:
    """Add landmarks as they were `found` by range alone to `graph`, as poses after its own, bound
    to it by their ranges.
    """
    landmarks_m = found.positions_m
    landmarks = np.column_stack([landmarks_m, np.zeros(len(landmarks_m))])
    ranges = heard.constraints(graph.poses, found, len(graph.poses))
    return replace(
        graph,
        poses=np.vstack([graph.poses, landmarks]),
        closures=graph.closures + ranges,
    )


def with_landmarks(graph: PoseGraph, seen: Sightings, landmarks_m: Floats) -> PoseGraph:
    """Add (k, 2) landmarks to `graph`, as poses after those of the path, bound to it by
    sightings.
    """
    headings_rad = np.zeros(len(landmarks_m))
    landmarks = np.column_stack([landmarks_m, headings_rad])

    weights = seen.weights(graph.poses, landmarks_m)
    sightings = seen.constraints(len(graph.poses), weights)

    return replace(
        graph,
        poses=np.vstack([graph.poses, landmarks]),
        closures=graph.closures + sightings,
    )


def by_side(seen: Sightings, poses: Floats, sides: int) -> Sightings:
    """Divide each landmark into one for each of so many sides, by the direction in which it is seen
    in the world.
    """
    forward_m, left_m = seen.where_m.T
    direction_rad = poses[seen.place, 2] + np.arctan2(left_m, forward_m)
    side = np.rint(direction_rad / FULL_TURN_RAD * sides).astype(np.int64) % sides
    key = seen.landmark * sides + side
    keys, landmark = np.unique(key, return_inverse=True)

    numbers = keys // sides
    labels = [seen.labels[number] for number in numbers.tolist()]
    return seen._replace(labels=tuple(labels), landmark=landmark)
