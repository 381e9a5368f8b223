"""Where the robot is, where it takes itself to be, and where its wheels alone would put it. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from schemas.base import Message
from schemas.graph import Delta, Node
from schemas.sensing import Odometry, Pose, TruePose, TrueTown

Floats = npt.NDArray[np.float64]
SELF_NODE = "self"


class Track:
    """Positions in the plane by the time of their sensing, in order of time."""

    def __init__(self) -> None:
        self._rows: list[tuple[int, float, float]] = []

    def add(self, stamp_ns: int, x_m: float, y_m: float) -> None:
        """Append a position. A newer one of the same stamp takes its place, one from before is
        passed over.
        """
        if self._rows and stamp_ns <= self._rows[-1][0]:
            if stamp_ns < self._rows[-1][0]:
                return
            self._rows.pop()
        self._rows.append((stamp_ns, x_m, y_m))

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def stamps_ns(self) -> npt.NDArray[np.int64]:
        """(n,), increasing."""
        return np.array([row[0] for row in self._rows], np.int64)

    @property
    def points_m(self) -> Floats:
        """(n, 2)."""
        return np.array([row[1:] for row in self._rows], np.float64).reshape(-1, 2)

    def covers(self, stamps_ns: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Which of the stamps lie between the first and the last position."""
        if not self._rows:
            return np.zeros(len(stamps_ns), bool)
        inside: npt.NDArray[np.bool_] = (self._rows[0][0] <= stamps_ns) & (
            stamps_ns <= self._rows[-1][0]
        )
        return inside

    def at(self, stamps_ns: npt.NDArray[np.int64]) -> Floats:
        """Positions (n, 2) at any stamps that it covers, interpolated."""
        times = self.stamps_ns
        points = self.points_m
        return np.stack([np.interp(stamps_ns, times, points[:, axis]) for axis in (0, 1)], axis=1)


@dataclass(frozen=True)
class Errors:
    """Distances from the truth at the same stamps, (n,) metres: of the self node, and of path
    integration alone.
    """

    stamps_ns: npt.NDArray[np.int64]
    estimate_m: Floats
    integration_m: Floats

    @property
    def ratio(self) -> float:
        """Mean error of the estimate over that of path integration alone; 1 where there is neither."""
        mean_m = float(self.integration_m.mean()) if self.integration_m.size else 0.0
        return float(self.estimate_m.mean()) / mean_m if mean_m > 0 else 1.0


class Observer:
    """Follows a drive from outside. The agent's frame has its origin in the pose that the robot
    starts from.
    """

    def __init__(self) -> None:
        self.town: TrueTown | None = None
        self.start: Pose | None = None
        self.travelled_m = self.progress = 0.0
        self._began_ns = self._now_ns = 0
        self._true, self._estimate, self._integrated = Track(), Track(), Track()
        self._wheels = (0.0, 0.0, 0.0)

    def take(self, message: Message) -> None:
        """Take in one message; of a kind that tells nothing about where the robot is, nothing."""
        if isinstance(message, TruePose):
            self._take_pose(message)
        elif isinstance(message, Odometry):
            self._take_odometry(message)
        elif isinstance(message, Delta):
            for node in message.operations:
                if isinstance(node, Node) and node.id == SELF_NODE:
                    self._take_self(node, message.stamp_ns)
        elif isinstance(message, TrueTown):
            self.town = message

    def _take_pose(self, true: TruePose) -> None:
        if self.start is None:
            self.start = true.pose
            self._began_ns = true.stamp_ns
        self._true.add(true.stamp_ns, true.pose.x_m, true.pose.y_m)
        self._now_ns = max(self._now_ns, true.stamp_ns)
        self.travelled_m = true.travelled_m
        self.progress = true.progress

    def _take_odometry(self, odometry: Odometry) -> None:
        """Midpoint integration: the heading of each step is the one half-way through it."""
        x_m, y_m, heading = self._wheels
        if not len(self._integrated):
            self._integrated.add(odometry.stamp_ns - round(odometry.dt_s * 1e9), x_m, y_m)
        middle = heading + odometry.turn_rate_rad_s * odometry.dt_s / 2
        step_m = odometry.speed_m_s * odometry.dt_s
        heading += odometry.turn_rate_rad_s * odometry.dt_s
        self._wheels = (x_m + step_m * math.cos(middle), y_m + step_m * math.sin(middle), heading)
        self._integrated.add(odometry.stamp_ns, *self._wheels[:2])

    def _take_self(self, node: Node, stamp_ns: int) -> None:
        x_m = node.attributes.get("x_m")
        y_m = node.attributes.get("y_m")
        if isinstance(x_m, int | float) and isinstance(y_m, int | float):
            self._estimate.add(stamp_ns, float(x_m), float(y_m))

    @property
    def elapsed_s(self) -> float:
        """Time of the drive so far, as its messages tell it."""
        return max(0, self._now_ns - self._began_ns) / 1e9

    def to_world(self, points_m: Floats) -> Floats:
        """Points (n, 2) of the agent's frame in the world's."""
        start = self.start or Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
        cos = math.cos(start.heading_rad)
        sin = math.sin(start.heading_rad)
        turned: Floats = points_m @ np.array([[cos, sin], [-sin, cos]])
        return np.array([start.x_m, start.y_m]) + turned

    @property
    def true_path_m(self) -> Floats:
        """(n, 2), in the world's frame like all paths here."""
        return self._true.points_m

    @property
    def estimated_path_m(self) -> Floats:
        """(n, 2): the self node's positions."""
        return self.to_world(self._estimate.points_m)

    @property
    def integrated_path_m(self) -> Floats:
        """(n, 2): raw odometry integrated, nothing else."""
        return self.to_world(self._integrated.points_m)

    def errors(self) -> Errors:
        """Every estimate whose stamp truth and odometry cover, against the truth of its stamp."""
        stamps_ns = self._estimate.stamps_ns
        estimates_m = self._estimate.points_m
        known = self._true.covers(stamps_ns) & self._integrated.covers(stamps_ns)
        stamps_ns = stamps_ns[known]
        estimates_m = estimates_m[known]
        if not stamps_ns.size:
            return Errors(stamps_ns, np.zeros(0), np.zeros(0))
        truth_m = self._true.at(stamps_ns)
        wheels_m = self._integrated.at(stamps_ns)
        estimate_m, integration_m = (
            np.linalg.norm(self.to_world(points_m) - truth_m, axis=1)
            for points_m in (estimates_m, wheels_m)
        )
        return Errors(stamps_ns, estimate_m, integration_m)
