"""Compares the robot's true path with its estimate and with path integration alone. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cogmap.errors import MessageError
from cogmap.evaluation.map_frame import MapFrame
from cogmap.evaluation.track import PathIntegrator, Track
from cogmap.geometry import se2
from cogmap.geometry.arrays import Floats, Indices
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import NEVER_NS, Self
from cogmap.schemas.process import Playback
from cogmap.schemas.sensing import Odometry, Pose, SelfMotion, TruePose

FOLLOWED = (
    topics.TRUE_POSE,
    topics.PLAYBACK,
    topics.ODOMETRY,
    topics.SELF_MOTION,
    topics.DELTA,
)
MOTION_COLUMNS = 5


@dataclass(frozen=True)
class Errors:
    """Distances from the true position at the same stamps, (n,) metres, and differences of heading
    from the true one, (n,) radians in (-pi, pi], counter-clockwise: of the self node, of the
    wheels' odometry integrated alone, and of the fused self-motion (`sensory/motion`) integrated
    alone. `poses` are the true ones, (n, 3).

    Those of the wheels are of shape (0,) where these publish nothing.
    """

    stamps_ns: Indices
    poses: Floats
    estimate_m: Floats
    estimate_rad: Floats
    wheels_m: Floats
    wheels_rad: Floats
    fused_m: Floats
    fused_rad: Floats

    @property
    def over_wheels(self) -> float | None:
        """Return the mean error of the estimate over the wheels' alone; None if these have none,
        as of a robot that never moved.
        """
        return _ratio(self.estimate_m, self.wheels_m)

    @property
    def over_fused(self) -> float | None:
        """Return the mean error of the estimate over fused self-motion's alone; None if that has
        none.
        """
        return _ratio(self.estimate_m, self.fused_m)


def _ratio(errors_m: Floats, baseline_m: Floats) -> float | None:
    if not baseline_m.any():
        return None
    return float(errors_m.mean() / baseline_m.mean())


class Paths:
    """Follows the robot's true path, the estimated one, and path integration alone. The agent's
    frame has its origin in the robot's first pose, until a map is recalled.

    `start` is the first true pose; None before there is one. `most` bounds the poses of each path.
    """

    def __init__(self, most: int | None = None) -> None:
        self.start: Pose | None = None
        self._start_ns = 0
        self._is_recording = False
        self._frame = MapFrame()
        self._true_m = 0.0
        self._true = Track(most)
        self._estimate = Track(most)
        self._wheels = PathIntegrator(most)
        self._fused = PathIntegrator(most)

    def update(self, message: Message) -> None:
        """Take account of one message; one that does not concern the robot's path is ignored.

        Raises MessageError if it is not what its topic carries.
        """
        match message:
            case TruePose():
                self._on_true_pose(message)
            case Playback():
                self._is_recording = True
            case Odometry() if not self._wheels.reached(message.stamp_ns):
                dt_ns = round(message.dt_s * 1e9)
                self._wheels.start(message.stamp_ns - dt_ns)
                self._wheels.move(message.speed_m_s, message.turn_rate_rad_s, message.dt_s)
                self._wheels.mark(message.stamp_ns)
            case SelfMotion():
                self._on_self_motion(message)
            case Delta():
                self._on_poses(message)

    def _on_true_pose(self, true: TruePose) -> None:
        pose = true.pose
        if self.start is None:
            self.start = pose
            self._start_ns = true.stamp_ns

        self._true.add(true.stamp_ns, pose.x_m, pose.y_m, pose.heading_rad)
        self._true_m = true.travelled_m

    def _on_self_motion(self, motion: SelfMotion) -> None:
        motions = motion.motions.numpy()
        if motions.ndim != 2 or motions.shape[1] != MOTION_COLUMNS:
            raise MessageError(f"self-motion of shape {motions.shape}: it needs (n, 5)")
        if self._fused.reached(motion.stamp_ns):
            return

        self._fused.start(motion.since_ns)
        for speed_m_s, turn_rate_rad_s, dt_s, *_ in motions.tolist():
            self._fused.move(speed_m_s, turn_rate_rad_s, dt_s)
        self._fused.mark(motion.stamp_ns)

    def _on_poses(self, delta: Delta) -> None:
        self._frame.update(delta)
        for operation in delta.operations:
            if isinstance(operation, Self) and operation.stamp_ns > NEVER_NS:
                # A late correction of the map moves the pose of a cycle before its own.
                pose = np.array([operation.x_m, operation.y_m, operation.heading_rad])
                self._estimate.add(operation.stamp_ns, *self._frame.pose_from_start(pose).tolist())

    @property
    def estimated_ns(self) -> int | None:
        """Return the stamp of the newest estimate; None if there is none."""
        return self._estimate.last_ns

    @property
    def travelled_m(self) -> float:
        """Return the distance that the robot has travelled: by self-motion if nobody knows the true
        one.
        """
        return self._fused.travelled_m if self.start is None else self._true_m

    @property
    def recalled(self) -> str:
        """Return the name of an earlier run's map that the agent has recalled, empty if none."""
        return self._frame.recalled

    def to_world(self, points_m: Floats) -> Floats:
        """Transform points (n, 2) of the agent's map into the world's frame."""
        return self._from_start(self._frame.from_start(points_m))

    def to_map(self, points_m: Floats) -> Floats:
        """Transform points (n, 2) of the world into the frame of the agent's map, in which goals
        are given.
        """
        return self._frame.to_map(se2.transform_to(self._origin, points_m))

    def _from_start(self, points_m: Floats) -> Floats:
        """Transform points (n, 2) of the frame in which the agent began into the world's."""
        return se2.transform_from(self._origin, points_m)

    @property
    def _origin(self) -> Floats:
        """Return the pose (3,), in the world, of the frame in which the agent began; where nobody
        knows it, that frame is the world's.

        Where a recording begins before anybody knew the robot's true pose, that frame is where the
        first one has it by path integration.
        """
        start = self.start
        if start is None:
            return np.zeros(3)

        pose = np.array([start.x_m, start.y_m, start.heading_rad])
        if self._is_recording:
            moved = self._fused.pose_at(self._start_ns)
            pose = se2.compose(pose, se2.relative(moved, np.zeros(3)))
        return pose

    @property
    def map_frame(self) -> Pose | None:
        """Return the origin of the agent's map in the world's frame; None before the first pose."""
        start = self.start
        if start is None:
            return None

        origin_and_ahead_m = np.array([[0.0, 0.0], [1.0, 0.0]])
        ((x_m, y_m), (ahead_x_m, ahead_y_m)) = self.to_world(origin_and_ahead_m).tolist()
        heading_rad = math.atan2(ahead_y_m - y_m, ahead_x_m - x_m)
        return Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

    @property
    def true_path_m(self) -> Floats:
        """Return the (n, 2) true path, in the world's frame like all paths here."""
        return self._true.points_m

    @property
    def estimated_path_m(self) -> Floats:
        """Return the (n, 2) positions of the self node."""
        return self._from_start(self._estimate.points_m)

    @property
    def wheels_path_m(self) -> Floats:
        """Return the (n, 2) path that the wheels' odometry alone adds up to."""
        return self._from_start(self._wheels.track.points_m)

    @property
    def fused_path_m(self) -> Floats:
        """Return the (n, 2) path that fused self-motion (`sensory/motion`) alone adds up to."""
        return self._from_start(self._fused.track.points_m)

    def errors(self) -> Errors:
        """Compute the errors at the stamp of every estimate that truth, wheels and fused
        self-motion cover; none of the wheels if these publish nothing, as at the level of percepts.
        """
        others = [self._true, self._fused.track]
        if len(self._wheels.track):
            others.append(self._wheels.track)
        stamps_ns = self._estimate.stamps_ns
        for track in others:
            stamps_ns = stamps_ns[track.covers(stamps_ns)]

        true = self._true.at(stamps_ns) if stamps_ns.size else np.zeros((0, 3))
        estimate_m, estimate_rad = self._off(self._estimate, stamps_ns, true)
        wheels_m, wheels_rad = self._off(self._wheels.track, stamps_ns, true)
        fused_m, fused_rad = self._off(self._fused.track, stamps_ns, true)
        return Errors(
            stamps_ns,
            true,
            estimate_m=estimate_m,
            estimate_rad=estimate_rad,
            wheels_m=wheels_m,
            wheels_rad=wheels_rad,
            fused_m=fused_m,
            fused_rad=fused_rad,
        )

    def _off(self, track: Track, stamps_ns: Indices, true: Floats) -> tuple[Floats, Floats]:
        """Measure how far the poses of `track` at (n,) stamps are from the true ones (n, 3), in
        metres and radians, (n,) each; (0,) if it has none.
        """
        if not len(track):
            return np.zeros(0), np.zeros(0)

        placed = se2.compose(self._origin, track.at(stamps_ns))
        off_m = placed[:, :2] - true[:, :2]
        off_rad = se2.wrap_angle(placed[:, 2] - true[:, 2])
        return np.hypot(*off_m.T), off_rad
