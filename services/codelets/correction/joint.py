"""The path optimized together with the landmarks seen along it (beyond the paper)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import PoseGraph
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import FULL_TURN_RAD
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.mapping.observations import Sightings

ROUNDS = 5


def optimize_jointly(graph: PoseGraph, seen: Sightings, config: Config) -> tuple[Floats, int]:
    """(n, 3) poses with the loops of `graph` closed, and bound to what was seen along the path, and
    how often the whole path was solved for that.

    Where a landmark seems to be depends on the side that it is seen from: of a building the front
    is measured, and its depth assumed. So each of its sides is taken for a landmark of its own,
    which binds one pass to the next past the same side, and bends neither. Sightings in a row err
    alike: `config.correlated_sightings` of them count as one.
    """
    poses = optimize(graph)
    if not len(seen.place):
        return poses, 1

    sides = by_side(seen, poses, config.landmark_sides)
    landmarks_m = sides.landmarks_m(poses)
    for _ in range(ROUNDS):
        path = replace(graph, poses=poses)
        joint = with_landmarks(path, sides, landmarks_m, config.correlated_sightings)
        optimized = optimize(joint)
        poses = optimized[: len(poses)]
        landmarks_m = optimized[len(poses) :, :2]

    return poses, 1 + ROUNDS


def with_landmarks(
    graph: PoseGraph, seen: Sightings, landmarks_m: Floats, correlated: float = 1.0
) -> PoseGraph:
    """`graph` with (k, 2) landmarks as poses after those of the path, bound to it by sightings of
    which `correlated` count as one.
    """
    headings_rad = np.zeros(len(landmarks_m))
    landmarks = np.column_stack([landmarks_m, headings_rad])

    weights = seen.weights(graph.poses, landmarks_m) / correlated
    sightings = seen.constraints(len(graph.poses), weights)

    return replace(
        graph,
        poses=np.vstack([graph.poses, landmarks]),
        closures=graph.closures + sightings,
    )


def by_side(seen: Sightings, poses: Floats, sides: int) -> Sightings:
    """The same sightings with a landmark for each of so many sides, by the direction in which the
    landmark is seen in the world.
    """
    side = _sides(seen, poses, sides)
    key = seen.landmark * sides + side
    keys, landmark = np.unique(key, return_inverse=True)

    numbers = keys // sides
    labels = [seen.labels[number] for number in numbers.tolist()]
    return seen._replace(labels=tuple(labels), landmark=landmark)


def _sides(seen: Sightings, poses: Floats, sides: int) -> Indices:
    """(m,): from which side each sighting is, 0 to `sides` - 1."""
    heading_rad = poses[seen.place, 2]
    forward_m, left_m = seen.where_m.T
    bearing_rad = np.arctan2(left_m, forward_m)

    direction_rad = heading_rad + bearing_rad
    turns = direction_rad / FULL_TURN_RAD
    sector = np.rint(turns * sides).astype(np.int64)
    side: Indices = sector % sides
    return side
