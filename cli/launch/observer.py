"""Compares the robot's true path with its estimate and with path integration alone. Pure."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from cogmap.cli.launch.frame import MapFrame
from cogmap.cli.launch.goals import GoalProgress
from cogmap.cli.launch.track import PathIntegrator, Track
from cogmap.errors import MessageError
from cogmap.geometry import se2
from cogmap.geometry.arrays import Floats, Indices
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import NEVER_NS, Self
from cogmap.schemas.process import Playback
from cogmap.schemas.sensing import Odometry, Pose, SelfMotion, TruePose, TrueTown

OBSERVED = (
    topics.TRUE_TOWN,
    topics.TRUE_POSE,
    topics.PLAYBACK,
    topics.ODOMETRY,
    topics.SELF_MOTION,
    topics.DELTA,
)
MOTION_COLUMNS = 5
MAX_REASONS = 8
STREET_M = 8.0
"""Farther from all of its path so far, the robot is in a street new to it."""


@dataclass(frozen=True)
class Errors:
    """Distances from the true position at the same stamps, (n,) metres: of the self node, of the
    wheels' odometry integrated alone, and of the fused self-motion (`sensory/motion`) integrated
    alone.
    """

    stamps_ns: Indices
    estimate_m: Floats
    wheels_m: Floats
    fused_m: Floats

    @property
    def over_wheels(self) -> float:
        """Return the mean error of the estimate over the wheels' alone; 1 if there is neither."""
        return _ratio(self.estimate_m, self.wheels_m)

    @property
    def over_fused(self) -> float:
        """Return the mean error of the estimate over fused self-motion's alone; 1 if there is
        neither.
        """
        return _ratio(self.estimate_m, self.fused_m)


def _ratio(errors_m: Floats, baseline_m: Floats) -> float:
    if not baseline_m.any():
        return 1.0
    return float(errors_m.mean() / baseline_m.mean())


class Played:
    """How much of a recording has been played: `recording` names it, and is empty where the drive
    is simulated. `reasons` say why the last of `skipped` views were left out, and what else was.
    """

    def __init__(self) -> None:
        self.recording = ""
        self.views = 0
        self.skipped = 0
        self.reasons: deque[str] = deque(maxlen=MAX_REASONS)

    def update(self, playback: Playback) -> None:
        """Take account of how far it is."""
        self.recording = playback.recording
        self.views = playback.views
        self.skipped = playback.skipped
        self.reasons.extend(playback.reasons)


class Observer:
    """Follows a drive from outside. The agent's frame has its origin in the robot's first pose,
    until a map is recalled.
    """

    def __init__(self) -> None:
        self.town: TrueTown | None = None
        self.start: Pose | None = None
        self.played = Played()
        self._true_m = 0.0
        self._start_ns = 0
        self.place_m = (0.0, 0.0)
        self.has_ended = False
        self._share_of_time = 0.0
        self.recalled_m: float | None = None
        self._frame = MapFrame()
        self._goals = GoalProgress()
        self._explored_ns = 0
        self._explored_m = 0.0
        self._began_ns: int | None = None
        self._now_ns = 0
        self._true = Track()
        self._estimate = Track()
        self._wheels = PathIntegrator()
        self._fused = PathIntegrator()

    def update(self, message: Message) -> None:
        """Take account of one message; one that does not concern the robot's path is ignored.

        Raises MessageError if it is not what its topic carries.
        """
        match message:
            case TruePose():
                self._on_pose(message)
            case Odometry() if not self._wheels.reached(message.stamp_ns):
                dt_ns = round(message.dt_s * 1e9)
                self._wheels.start(message.stamp_ns - dt_ns)
                self._wheels.move(message.speed_m_s, message.turn_rate_rad_s, message.dt_s)
                self._wheels.mark(message.stamp_ns)
            case SelfMotion():
                self._on_self_motion(message)
            case Delta():
                self._on_delta(message)
            case TrueTown():
                self.town = message
            case Playback():
                self.played.update(message)
                self._tick(message.stamp_ns, message.progress)

    def _tick(self, stamp_ns: int, share: float) -> None:
        """Note that so much of the drive's time has passed."""
        if self._began_ns is None:
            self._began_ns = stamp_ns
        self._now_ns = max(self._now_ns, stamp_ns)
        self.has_ended = share >= 1.0
        self._share_of_time = share

    def _on_pose(self, true: TruePose) -> None:
        pose = true.pose
        if self.start is None:
            self.start = pose
            self._start_ns = true.stamp_ns

        self.place_m = (pose.x_m, pose.y_m)
        self._true.add(true.stamp_ns, pose.x_m, pose.y_m)
        self._true_m = true.travelled_m
        self._tick(true.stamp_ns, true.progress)

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

    def _on_delta(self, delta: Delta) -> None:
        self._goals.update(delta, self.travelled_m)
        if not self.goals:
            self._explored_ns = self._now_ns
            self._explored_m = self.travelled_m

        self._frame.update(delta)
        if self.recalled and self.recalled_m is None:
            self.recalled_m = self.travelled_m

        for operation in delta.operations:
            if isinstance(operation, Self) and operation.stamp_ns > NEVER_NS:
                # A late correction of the map moves the pose of a cycle before its own.
                position_m = np.array([[operation.x_m, operation.y_m]])
                ((x_m, y_m),) = self._frame.from_start(position_m).tolist()
                self._estimate.add(operation.stamp_ns, x_m, y_m)

    @property
    def has_begun(self) -> bool:
        """Return whether the robot has been somewhere, or a recording is being played."""
        return self._began_ns is not None

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

    @property
    def goals(self) -> int:
        """Return how many goals the agent has."""
        return self._goals.count

    @property
    def goals_reached(self) -> int:
        """Return how many of its goals the agent has reached."""
        return self._goals.reached

    @property
    def progress(self) -> float:
        """Return the share of its goals that the agent has reached, the way to the next one
        included; if it has none, the share of the drive's time that has passed.
        """
        if not self.goals:
            return self._share_of_time
        return self._goals.share(self.travelled_m)

    @property
    def now_s(self) -> float:
        """Return the simulated time."""
        return self._now_ns / 1e9

    @property
    def elapsed_s(self) -> float:
        """Return the time of the drive so far, by the stamps of its messages."""
        began_ns = self._now_ns if self._began_ns is None else self._began_ns
        elapsed_ns = self._now_ns - began_ns
        return max(0, elapsed_ns) / 1e9

    def to_world(self, points_m: Floats) -> Floats:
        """Transform points (n, 2) of the agent's map into the world's frame."""
        return self._from_start(self._frame.from_start(points_m))

    def _from_start(self, points_m: Floats) -> Floats:
        """Transform points (n, 2) of the frame in which the agent began into the world's.

        Where a recording begins before anybody knew the robot's true pose, that frame is where the
        first one has it by path integration.
        """
        start = self.start
        if start is None:
            return points_m

        pose = np.array([start.x_m, start.y_m, start.heading_rad])
        if self.played.recording:
            moved = self._fused.pose_at(self._start_ns)
            pose = se2.compose(pose, se2.relative(moved, np.zeros(3)))
        return se2.transform_from(pose, points_m)

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
    def shortcuts_m(self) -> Floats:
        """Return the (n, 2, 2) steps of the true path to goals through streets that the robot had
        not been in before it had any; none if it had goals before it had left its first street.
        """
        if not self.goals or self._explored_m < STREET_M:
            return np.zeros((0, 2, 2))
        return self._true.new_since_m(self._explored_ns, STREET_M)

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

        if not stamps_ns.size:
            nothing = np.zeros(0)
            return Errors(stamps_ns, nothing, nothing, nothing)
        return Errors(
            stamps_ns,
            estimate_m=self._distances_m(self._estimate, stamps_ns),
            wheels_m=self._distances_m(self._wheels.track, stamps_ns),
            fused_m=self._distances_m(self._fused.track, stamps_ns),
        )

    def _distances_m(self, track: Track, stamps_ns: Indices) -> Floats:
        """Measure how far the positions of `track` at (n,) stamps are from the true ones, (n,);
        (0,) if it has none.
        """
        if not len(track):
            return np.zeros(0)

        off_m = self._from_start(track.at(stamps_ns)) - self._true.at(stamps_ns)
        distances_m: Floats = np.hypot(*off_m.T)
        return distances_m
