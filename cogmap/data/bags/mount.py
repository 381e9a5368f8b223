"""Where sensors of a bag stand on the robot, by its static transforms."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from cogmap.data.bags.bag import Bag
from cogmap.geometry.arrays import Floats

TRANSFORMS = "tf2_msgs/msg/TFMessage"
STATIC = "/tf_static"


class Mount(NamedTuple):
    """How a sensor is turned, and where it stands, (3,), in the frame of its robot."""

    turn: Rotation
    place_m: Floats

    def placed(self, points_m: Floats) -> Floats:
        """Return (n, 3) points of the sensor's frame in that of the robot."""
        placed: Floats = self.turn.apply(points_m) + self.place_m
        return placed


def mount_of(bag: Bag, frame: str) -> Mount:
    """Return where a sensor's frame is in that at the root of the static transforms; where none
    lead from it, it is the robot's own.
    """
    above: dict[str, Any] = {}
    if bag.topics.get(STATIC) == TRANSFORMS:
        for message in bag.unstamped(STATIC):
            above.update(steps_of(message))
    return mount_by(above, frame)


def steps_of(message: Any) -> dict[str, Any]:
    """Return the transforms of a TFMessage by the frame that each places."""
    return {_name(each.child_frame_id): each for each in message.transforms}


def mount_by(transforms: Mapping[str, Any], frame: str) -> Mount:
    """Return where a sensor's frame is by static transforms, as `steps_of` returns them."""
    above = dict(transforms)
    mount = Mount(Rotation.identity(), np.zeros(3))
    name = _name(frame)
    while name in above:
        step = above.pop(name)
        name = _name(step.header.frame_id)
        moved = step.transform.translation
        place_m = np.array([moved.x, moved.y, moved.z])
        parent = Mount(_rotation(step.transform.rotation), place_m)
        mount = Mount(parent.turn * mount.turn, parent.placed(mount.place_m))
    return mount


def _rotation(quaternion: Any) -> Rotation:
    """Return a rotation; none of a quaternion that nobody filled in."""
    values = np.array([quaternion.x, quaternion.y, quaternion.z, quaternion.w])
    return Rotation.from_quat(values) if values.any() else Rotation.identity()


def _name(frame: str) -> str:
    """Return a frame's name as in ROS 2: in ROS 1 it may begin with a slash."""
    return frame.removeprefix("/")
