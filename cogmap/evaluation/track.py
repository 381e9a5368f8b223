"""A path in the plane: poses by the time that they are of."""

from __future__ import annotations

import math
from array import array

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.polylines import interpolate

POSE_COLUMNS = 3


class Track:
    """Poses in the order of their stamps: `most` of them, if it is given. Where more come, every
    second one of those before is left out.
    """

    def __init__(self, most: int | None = None) -> None:
        self._most = most
        self._stamps_ns = array("q")
        self._poses = array("d")

    def add(self, stamp_ns: int, x_m: float, y_m: float, heading_rad: float) -> None:
        """Append a pose. It replaces one of the same stamp; one that is out of order is ignored."""
        pose = (x_m, y_m, heading_rad)
        last_ns = self.last_ns

        if last_ns is None or stamp_ns > last_ns:
            if len(self) == self._most:
                self._thin()
            self._stamps_ns.append(stamp_ns)
            self._poses.extend(pose)
        elif stamp_ns == last_ns:
            self._poses[-POSE_COLUMNS:] = array("d", pose)

    @property
    def last_ns(self) -> int | None:
        """Return the stamp of the last pose; None if there is none."""
        return self._stamps_ns[-1] if self._stamps_ns else None

    def __len__(self) -> int:
        return len(self._stamps_ns)

    @property
    def stamps_ns(self) -> Indices:
        """Return the (n,) stamps, increasing."""
        return np.array(self._stamps_ns, np.int64)

    @property
    def poses(self) -> Floats:
        """Return the (n, 3) poses."""
        poses = np.array(self._poses, np.float64)
        return poses.reshape(-1, POSE_COLUMNS)

    @property
    def points_m(self) -> Floats:
        """Return the (n, 2) positions."""
        return self.poses[:, :2]

    def covers(self, stamps_ns: Indices) -> Booleans:
        """Mark the stamps, of any shape, that lie between the first and the last pose."""
        if not self._stamps_ns:
            return np.zeros(stamps_ns.shape, bool)

        first_ns = self._stamps_ns[0]
        last_ns = self._stamps_ns[-1]
        after_first: Booleans = stamps_ns >= first_ns
        before_last: Booleans = stamps_ns <= last_ns
        return after_first & before_last

    def at(self, stamps_ns: Indices) -> Floats:
        """Interpolate poses (k, 3) at (k,) stamps; outside of the track they are that of its nearer
        end. A heading turns the shorter way, and is not wrapped. There must be a pose.
        """
        first_ns = self._stamps_ns[0]
        known_ns = self.stamps_ns - first_ns
        wanted_ns = stamps_ns - first_ns

        poses = self.poses
        poses[:, 2] = np.unwrap(poses[:, 2])
        known_s = known_ns / 1e9
        wanted_s = wanted_ns / 1e9
        return interpolate(known_s, poses, wanted_s)

    def new_since_m(self, stamp_ns: int, away_m: float) -> Floats:
        """Return the (n, 2, 2) steps after `stamp_ns` that lead farther than `away_m` past every
        position until then; none if there is no position until then.
        """
        points_m = self.points_m
        count = int(np.searchsorted(self.stamps_ns, stamp_ns, side="right"))
        steps_m = np.stack([points_m[:-1], points_m[1:]], axis=1)[max(0, count - 1) :]
        if not count or not len(steps_m):
            return np.zeros((0, 2, 2))

        # Whoever watches a drive would wait for its import at the start.
        from scipy.spatial import cKDTree

        from_known_m, _ = cKDTree(points_m[:count]).query(steps_m.mean(axis=1))
        new_m: Floats = steps_m[from_known_m > away_m]
        return new_m

    def _thin(self) -> None:
        stamps_ns = self.stamps_ns[::2]
        poses = self.poses[::2]
        self._stamps_ns = array("q", stamps_ns.tobytes())
        self._poses = array("d", poses.tobytes())


class PathIntegrator:
    """Path integration alone: measured speeds add up to a path from the origin, heading along x,
    and to the distance `travelled_m`, there and back. `most` bounds its track.
    """

    def __init__(self, most: int | None = None) -> None:
        self.track = Track(most)
        self.travelled_m = 0.0
        self._x_m = 0.0
        self._y_m = 0.0
        self._heading_rad = 0.0

    def start(self, stamp_ns: int) -> None:
        """Begin the path at the origin, unless it has begun."""
        if not len(self.track):
            self.mark(stamp_ns)

    def reached(self, stamp_ns: int) -> bool:
        """Decide whether the path has come to this stamp already: in lockstep a message is repeated
        to a module that was restarted.
        """
        last_ns = self.track.last_ns
        return last_ns is not None and stamp_ns <= last_ns

    def move(self, speed_m_s: float, turn_rate_rad_s: float, dt_s: float) -> None:
        """Integrate one step by its midpoint: it heads where the robot did half-way through it."""
        turn_rad = turn_rate_rad_s * dt_s
        midpoint_rad = self._heading_rad + turn_rad / 2
        distance_m = speed_m_s * dt_s

        self.travelled_m += abs(distance_m)
        self._x_m += distance_m * math.cos(midpoint_rad)
        self._y_m += distance_m * math.sin(midpoint_rad)
        self._heading_rad += turn_rad

    def mark(self, stamp_ns: int) -> None:
        """Append the pose that the steps so far have led to."""
        self.track.add(stamp_ns, self._x_m, self._y_m, self._heading_rad)

    def pose_at(self, stamp_ns: int) -> Floats:
        """Interpolate the pose (3,) at a stamp; outside of the path it is that of its nearer end,
        and the origin if there is no path.
        """
        if not len(self.track):
            return np.zeros(3)

        pose: Floats = self.track.at(np.array([stamp_ns], np.int64))[0]
        return pose
