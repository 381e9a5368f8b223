"""What is observed of one loop: the map before and after its corrections, and the replays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.errors import CogmapError
from cogmap.estimation.pose_graph import PoseGraph
from cogmap.estimation.reverse_replay import with_positions_only
from cogmap.experiments import reading
from cogmap.experiments.dead_reckoning import DeadReckoning
from cogmap.experiments.predictions.replayed import Replayed
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.cognition import Replay
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.nodes import LoopClosure
from cogmap.schemas.sensing import TruePose
from cogmap.services.codelets.mapping.path import steps_of
from cogmap.services.codelets.mapping.views import constraints_of, views_of
from cogmap.services.codelets.public import CodeletsConfig


@dataclass(frozen=True)
class Map:
    """What the agent believes at one time, in its own frame, which begins as the true one does.

    (n, 2) `path_m` and `true_path_m` at the same stamps, (k, 2) `objects_m` and where they truly
    stand, and `road_m`.
    """

    path_m: Floats
    true_path_m: Floats
    objects_m: Floats
    true_objects_m: Floats
    road_m: Floats

    @property
    def path_error_m(self) -> float:
        """Return the root mean square error over the path."""
        offsets_m = self.path_m - self.true_path_m
        return rms_m(offsets_m)

    @property
    def object_error_m(self) -> float:
        """Return the root mean square error over the objects."""
        offsets_m = self.objects_m - self.true_objects_m
        return rms_m(offsets_m)

    @property
    def end_error_m(self) -> float:
        """Return the distance of the agent's estimate from where it is."""
        dx_m, dy_m = self.path_m[-1] - self.true_path_m[-1]
        return float(np.hypot(dx_m, dy_m))


@dataclass(frozen=True)
class Loop:
    """The map before the first correction was applied, right after it, and in the end.

    `constraints` are those of the path before: its steps, and the closures that were accepted, for
    positions alone.

    `fused_path_m` and `wheels_path_m` (n, 2) are the path in the end as self-motion alone and as
    the wheels alone would have it. They are the same where self-motion is the wheels'.
    """

    before: Map
    after: Map
    end: Map
    constraints: PoseGraph
    fused_path_m: Floats
    wheels_path_m: Floats
    replays: list[Replayed]


class Observer:
    """Follows the graph, the truth, the odometry and the replays of one drive."""

    def __init__(self, landmarks: dict[str, tuple[float, float]], config: CodeletsConfig) -> None:
        self._landmarks = landmarks
        self._config = config
        self._graph = Graph()
        self._true: dict[int, tuple[float, float]] = {}
        self._wheels = DeadReckoning()
        self._replays: list[Replayed] = []
        self._before: Map | None = None
        self._constraints: PoseGraph | None = None
        self._after: Map | None = None

    def module(self) -> Module:
        """Build the module `observer`."""
        return (
            Module("observer")
            .on(topics.DELTA, self.on_delta)
            .on(topics.TRUE_POSE, self.on_pose)
            .on(topics.ODOMETRY, self._wheels.on_odometry)
            .on(topics.REPLAY, self.on_replay)
        )

    def loop(self) -> Loop:
        """Return what was observed. Raises CogmapError if no loop was closed."""
        if self._before is None or self._after is None or self._constraints is None:
            raise CogmapError("no loop was closed on the path")

        rows = reading.path_rows(self._graph)
        fused_path_m = rows[:, reading.ODOMETRY][:, :2]
        wheels_path_m = fused_path_m
        if self._wheels:
            wheels_path_m = self._wheels.poses(rows[:, reading.STAMP])[:, :2]

        return Loop(
            before=self._before,
            after=self._after,
            end=self._map(),
            constraints=self._constraints,
            fused_path_m=fused_path_m,
            wheels_path_m=wheels_path_m,
            replays=self._replays,
        )

    def on_delta(self, delta: Delta) -> None:
        """Follow the graph, and keep the map around its first correction. Raises CogmapError if a
        delta is missing.
        """
        corrects = delta.phase is Phase.CORRECTION and self._before is None
        if corrects:
            self._before = self._map()
            self._constraints = self._pose_graph()

        if not self._graph.apply(delta):
            raise CogmapError(f"delta {delta.version} is not the next one")

        if corrects:
            self._after = self._map()

    def on_pose(self, true: TruePose) -> None:
        """Keep the true position by its stamp."""
        pose = true.pose
        self._true[true.stamp_ns] = (pose.x_m, pose.y_m)

    def on_replay(self, replay: Replay) -> None:
        """Keep a reverse replay."""
        self._replays.append(Replayed.of(replay))

    def _pose_graph(self) -> PoseGraph:
        """Return the path as it is now, and what constrains its positions."""
        rows = reading.path_rows(self._graph)
        closures = [each for each in self._graph.of_kind(LoopClosure) if each.accepted]
        views = views_of([each for each in closures if not each.range_alone], rows)

        poses = rows[:, reading.POSE]
        steps = steps_of(rows, self._config)
        return with_positions_only(PoseGraph(poses, steps, constraints_of(views, poses)))

    def _map(self) -> Map:
        """Return the map as it is now, with the true position at the stamp nearest to each."""
        rows = reading.path_rows(self._graph)
        stamps_ns = np.rint(rows[:, reading.STAMP] * 1e9).astype(np.int64)
        known_ns = np.array(list(self._true))
        nearest = np.abs(known_ns - stamps_ns[:, None]).argmin(axis=1)
        known_m = np.array(list(self._true.values()), np.float64)
        path_m = rows[:, reading.POSE][:, :2]

        labels = sorted(self._landmarks)
        objects_m = reading.object_positions_m(self._graph, labels)
        true_objects_m = np.array([self._landmarks[label] for label in labels])
        is_known = ~np.isnan(objects_m[:, 0])

        return Map(
            path_m=path_m,
            true_path_m=known_m[nearest].reshape(-1, 2),
            objects_m=objects_m[is_known],
            true_objects_m=true_objects_m[is_known],
            road_m=reading.road_m(self._graph),
        )


def rms_m(offsets_m: Floats) -> float:
    """Return the root mean square length of (n, 2) offsets, 0 if there are none."""
    if not len(offsets_m):
        return 0.0

    squared_m2 = np.square(offsets_m).sum(axis=1)
    return float(np.sqrt(squared_m2.mean()))
