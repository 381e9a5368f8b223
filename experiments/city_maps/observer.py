"""What one traversal made of a city: the map in the end, beside the truth and path integration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.errors import CogmapError
from cogmap.experiments import reading
from cogmap.experiments.city_maps.guide import Outcome
from cogmap.experiments.city_maps.streets import Points
from cogmap.experiments.dead_reckoning import DeadReckoning
from cogmap.experiments.reading import Pose
from cogmap.geometry.se2 import transform_from
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.sensing import TruePose

WHEELS = "wheels"
FUSED = "fused"


@dataclass(frozen=True, eq=False)
class Traversal:
    """What one agent made of one tour, in the true frame: (n, 3) poses believed and true, by view.

    `path_m` (n, 2) is the path as the map has it in the end, `buildings_m` (8, 2) has NaN for one
    that is not on the map, and `road_m` (k, 2) are the cells that are road. `alone_m` has the
    buildings (8, 2) where they would be by path integration alone, of the WHEELS and, where they
    are fused with views, of FUSED self-motion. `outcome` is how the drive ended if the agent drove
    itself.
    """

    believed: Points
    true: Points
    path_m: Points
    buildings_m: Points
    road_m: Points
    alone_m: dict[str, Points]
    outcome: Outcome | None = None

    @property
    def missing(self) -> int:
        """Return how many buildings are not on the map."""
        is_missing = np.isnan(self.buildings_m[:, 0])
        return int(is_missing.sum())


class Observer:
    """Follows the graph, the truth and the odometry of one traversal.

    `origin` (3,) is the true pose where the agent's own frame begins; `names` are the buildings'.
    """

    def __init__(self, origin: Points, names: tuple[str, ...]) -> None:
        self._origin = origin
        self._names = names
        self._graph = Graph()
        self._wheels = DeadReckoning()
        self._believed: list[Pose] = []
        self._true: list[Pose] = []

    def module(self) -> Module:
        """Build the module `observer`."""
        return (
            Module("observer")
            .on(topics.DELTA, self.on_delta)
            .on(topics.TRUE_POSE, self.on_pose)
            .on(topics.ODOMETRY, self._wheels.on_odometry)
        )

    def traversal(self) -> Traversal:
        """Return all that was observed."""
        believed = np.array(self._believed)
        path = reading.path_rows(self._graph)

        # By path integration alone: without images, self-motion is that of the wheels.
        fused = path[:, reading.ODOMETRY].copy()
        fused[:, :2] -= fused[0, :2] - path[0, reading.POSE][:2]
        alone_m = {WHEELS: self._seen_from(fused)}
        if self._wheels:
            wheels = self._wheels.poses(path[:, reading.STAMP])
            alone_m = {WHEELS: self._seen_from(wheels), FUSED: alone_m[WHEELS]}

        heading_rad = believed[:, 2] + self._origin[2]
        return Traversal(
            believed=np.column_stack([self._placed(believed[:, :2]), heading_rad]),
            true=np.array(self._true)[: len(believed)],
            path_m=self._placed(path[:, reading.POSE][:, :2]),
            buildings_m=self._placed(reading.object_positions_m(self._graph, self._names)),
            road_m=self._placed(reading.road_m(self._graph)),
            alone_m=alone_m,
        )

    def on_delta(self, delta: Delta) -> None:
        """Follow the graph, and keep each estimate. Raises CogmapError if a delta is missing."""
        if not self._graph.apply(delta):
            raise CogmapError(f"delta {delta.version} is not the next one")

        if delta.phase is Phase.LOCALIZATION:
            pose = reading.self_pose(self._graph)
            self._believed.append(pose)

    def on_pose(self, true: TruePose) -> None:
        """Keep the true pose of each view."""
        pose = true.pose
        self._true.append((pose.x_m, pose.y_m, pose.heading_rad))

    def _seen_from(self, poses: Points) -> Points:
        """Return the median of all observations of each building, (8, 2), from `poses` of the path,
        in the true frame.
        """
        seen = reading.observations(self._graph)
        where_m = transform_from(poses[seen.place], seen.where_m)
        numbers = {label: number for number, label in enumerate(seen.labels)}
        objects = reading.objects_by_name(self._graph)
        buildings_m = np.full((len(self._names), 2), np.nan)

        for row, name in enumerate(self._names):
            label = objects[name].label if name in objects else ""
            if label in numbers:
                of_it = seen.landmark == numbers[label]
                buildings_m[row] = np.median(where_m[of_it], axis=0)

        return self._placed(buildings_m)

    def _placed(self, own_m: Points) -> Points:
        """Return (n, 2) positions of the agent's own frame in the true one."""
        return transform_from(self._origin, own_m)
