"""The turns of two wheels, as sensor_msgs/JointState has them, as odometry. Pure."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import arc, compose

JOINT_STATE = "sensor_msgs/msg/JointState"


class WheelJoints(NamedTuple):
    """The names of the joints of two driven wheels, their radius, and how far apart they are."""

    left: str
    right: str
    radius_m: float
    track_m: float


class Encoders:
    """Adds up how far the wheels have rolled."""

    def __init__(self, joints: WheelJoints) -> None:
        self._joints = joints
        self._last: tuple[int, Floats] | None = None
        self._pose: Floats = np.zeros(3)

    def on_joints(self, stamp_ns: int, message: Any) -> tuple[Floats, Floats] | None:
        """Receive the positions of joints. Returns the pose (3,) that the wheels have led to, and
        the speeds (2,) since the message before; None if these are not the wheels', or are old.

        Raises UsageError if the wheels have no positions.
        """
        names = list(message.name)
        wheels = (self._joints.left, self._joints.right)
        if not set(wheels) <= set(names):
            return None
        if len(message.position) != len(names):
            raise UsageError(
                f"the joints {' and '.join(wheels)} have no positions: publish these, not speeds "
                "alone, or give nav_msgs/msg/Odometry"
            )

        rolled_m = self._joints.radius_m * np.array(
            [float(message.position[names.index(name)]) for name in wheels]
        )
        last_ns, last_m = self._last or (stamp_ns, rolled_m)
        if stamp_ns < last_ns:
            return None
        self._last = (stamp_ns, rolled_m)

        left_m, right_m = (rolled_m - last_m).tolist()
        ahead_m = (left_m + right_m) / 2
        turned_rad = (right_m - left_m) / self._joints.track_m
        self._pose = compose(self._pose, arc(ahead_m, turned_rad))
        passed_s = (stamp_ns - last_ns) / 1e9
        speeds = np.array([ahead_m, turned_rad]) / passed_s if passed_s else np.zeros(2)
        return self._pose, speeds
