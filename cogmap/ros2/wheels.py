"""Odometry as it comes, as motions of which one ends at each view. Pure."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from cogmap.data.bags.odometry import Poses
from cogmap.data.bags.order import NS_PER_S
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, moved_by
from cogmap.recording.exporting.ros_drive import arc_of
from cogmap.schemas.sensing import Odometry

STALE_NS = 500_000_000
"""Odometry that is so much older than a view says nothing of the motion until it: slow robots
publish ten times a second.
"""

REMEMBERED = 1024
"""Poses that are remembered: those between two views, and those of some seconds for the transform
of a belief.
"""


class _Sample(NamedTuple):
    """A pose (3,) of the robot in the frame of its odometry, and its speeds (2,)."""

    stamp_ns: int
    pose: Floats
    speeds: Floats


class OdometryStream:
    """The wheels' motions from the poses on `topic`, of type `kind`, gapless from view to view.

    A view does not wait for the pose after it: the last speeds are taken to hold until then, and
    the next motion leads from there to where the robot really came to be, so that no error adds up.
    """

    def __init__(self, topic: str, kind: str) -> None:
        self.jumps = 0
        self._topic = topic
        self._kind = kind
        self._samples: deque[_Sample] = deque(maxlen=REMEMBERED)
        self._told: _Sample | None = None

    def on_pose(self, stamp_ns: int, pose: Floats, speeds: Floats) -> None:
        """Receive the pose (3,) of the robot in the frame of its odometry, x_m, y_m and
        heading_rad, and its speeds (2,), in m/s and rad/s; those older than the last are ignored.
        Raises UsageError if a number is not finite.
        """
        if not (np.isfinite(pose).all() and np.isfinite(speeds).all()):
            raise UsageError(
                f"{self._topic} has numbers that are not finite: leave such odometry out"
            )
        if self._samples and stamp_ns <= self._samples[-1].stamp_ns:
            return

        # A pose that nobody filled in is that to which the speeds lead.
        if self._samples and not pose.any():
            pose = _ahead(self._samples[-1], stamp_ns).pose
        self._samples.append(_Sample(stamp_ns, pose, speeds))

    def until(self, view_ns: int) -> list[Odometry]:
        """Return the motions from the view before, of which the last one ends at this one; none for
        the first. Raises UsageError if there is no odometry that is new enough.
        """
        self._check(view_ns)
        samples = list(self._samples)
        if samples[-1].stamp_ns < view_ns:
            samples.append(_ahead(samples[-1], view_ns))
        if self._told is None:
            self._told = _ahead(self._last_before(view_ns), view_ns)
            return []

        told = self._told
        samples = [told, *(each for each in samples if each.stamp_ns > told.stamp_ns)]
        if view_ns <= told.stamp_ns:
            return []
        motions = Poses(
            np.array([each.stamp_ns for each in samples]),
            np.array([each.pose for each in samples]),
            np.array([each.speeds for each in samples]),
        ).motions(np.array([view_ns]))
        self.jumps += motions.jumps

        moved = []
        pose = told.pose
        for stamp_ns, row in zip(motions.stamps_ns.tolist(), motions.rows.tolist(), strict=True):
            if stamp_ns <= view_ns:
                speed_m_s, turn_rate_rad_s, dt_s = row
                moved.append(
                    Odometry(
                        stamp_ns=stamp_ns,
                        speed_m_s=speed_m_s,
                        turn_rate_rad_s=turn_rate_rad_s,
                        dt_s=dt_s,
                    )
                )
                pose = compose(pose, arc_of(moved[-1]))
        if motions.jumps:
            pose = samples[-1].pose
        self._told = _Sample(view_ns, pose, samples[-1].speeds)
        return moved

    def pose_at(self, stamp_ns: int) -> Floats:
        """Return the pose (3,) that the odometry had at a stamp."""
        if not self._samples:
            return np.zeros(3)
        return _ahead(self._last_before(stamp_ns), stamp_ns).pose

    def _check(self, view_ns: int) -> None:
        if not self._samples:
            raise UsageError(
                f"nothing of the robot's wheels has come on {self._topic} ({self._kind}): start "
                "what publishes it, or leave it out by --no-odometry"
            )
        behind_ns = view_ns - self._samples[-1].stamp_ns
        if behind_ns > STALE_NS:
            raise UsageError(
                f"a view is {behind_ns / 1e9:.1f} s newer than what came last on {self._topic}: "
                "publish odometry as often, and stamp both by one clock"
            )

    def _last_before(self, stamp_ns: int) -> _Sample:
        """Return the last pose up to a stamp; the first one if all are later."""
        for each in reversed(list(self._samples)):  # another thread may add one
            if each.stamp_ns <= stamp_ns:
                return each
        return self._samples[0]


def _ahead(sample: _Sample, stamp_ns: int) -> _Sample:
    """Return where the speeds of a pose lead to until then; the same pose if that was before."""
    ahead_s = max(0, stamp_ns - sample.stamp_ns) / NS_PER_S
    pose = moved_by(sample.pose, np.array([[*sample.speeds, ahead_s]]))
    return _Sample(stamp_ns, pose, sample.speeds)
