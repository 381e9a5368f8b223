"""Where the cameras of a bag stand on the robot, by its static transforms."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cogmap.data.bags.bag import Bag
from cogmap.geometry.arrays import Floats

TRANSFORMS = "tf2_msgs/msg/TFMessage"
STATIC = "/tf_static"

HEIGHT_M = 1.0
"""Of cameras of which nothing says how high above the ground they are."""


def mount_of(bag: Bag, frame: str, height_m: float) -> dict[str, float]:
    """Return how high above the ground, and how far ahead, a camera's frame is in the frame of its
    robot, named as Calibration does. `height_m` is what the user says, 0 if nothing.
    """
    placed = _placed(bag, frame)
    forward_m = 0.0 if placed is None else float(placed[0])
    above_m = 0.0 if placed is None else float(placed[2])
    return {
        "mount_height_m": height_m or max(above_m, 0.0) or HEIGHT_M,
        "mount_forward_m": forward_m,
    }


def _placed(bag: Bag, frame: str) -> Floats | None:
    """Return where a frame is in that at the root of the static transforms, (3,); None if there
    are none that lead from it.
    """
    if bag.topics.get(STATIC) != TRANSFORMS:
        return None

    above: dict[str, Any] = {}
    for message in bag.unstamped(STATIC):
        above.update({_name(each.child_frame_id): each for each in message.transforms})

    place_m = np.zeros(3)
    name = _name(frame)
    if name not in above:
        return None
    while name in above:
        step = above.pop(name)
        name = _name(step.header.frame_id)
        turn = step.transform.rotation
        moved = step.transform.translation
        rotation = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w])
        place_m = rotation.apply(place_m) + np.array([moved.x, moved.y, moved.z])
    return place_m


def _name(frame: str) -> str:
    """Return a frame's name as in ROS 2: in ROS 1 it may begin with a slash."""
    return frame.removeprefix("/")
