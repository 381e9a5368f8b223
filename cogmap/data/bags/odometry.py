"""nav_msgs/Odometry as self-motion: mean speeds between its messages, divided at each view."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from cogmap.data.bags.bag import Bag
from cogmap.data.bags.order import NS_PER_S, in_order
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import wrap_angle

LONGEST_NS = 10 * NS_PER_S
"""A longer motion is divided: no message of odometry lasts longer."""

MAX_SPEED_M_S = 100.0
MAX_TURN_RATE_RAD_S = 100.0
"""What is faster is a jump of the odometry, as where it was set to 0: no wheels do that."""


class Motions(NamedTuple):
    """Self-motion in order of time: (n,) stamps at which motions end, and float64 (n, 3) rows of
    speed_m_s, turn_rate_rad_s and dt_s. `jumps` is how many are left out as no wheels move so.
    """

    stamps_ns: Indices
    rows: Floats
    jumps: int

    @property
    def notes(self) -> list[str]:
        """Say what is left out, if anything is."""
        if not self.jumps:
            return []
        return [f"{self.jumps} jumps of the odometry are left out: no wheels move so"]


class Poses(NamedTuple):
    """Odometry as it was recorded, in order of time: (n,) stamps, float64 (n, 3) poses x_m, y_m and
    heading_rad, and (n, 2) speeds, in m/s and rad/s.
    """

    stamps_ns: Indices
    poses: Floats
    speeds: Floats

    def motions(self, views_ns: Indices) -> Motions:
        """Return the motions, one of which ends at each of the (m,) stamps of views in between."""
        moved = self._rows()
        is_jump = (np.abs(moved) > (MAX_SPEED_M_S, MAX_TURN_RATE_RAD_S)).any(axis=1)
        moved[is_jump] = 0.0

        ends_ns = _ends(self.stamps_ns, views_ns)
        lasts_s = np.diff(ends_ns) / NS_PER_S
        of_row = np.searchsorted(self.stamps_ns, ends_ns[1:]) - 1
        rows = np.column_stack([moved[of_row], lasts_s])
        return Motions(ends_ns[1:], rows, int(is_jump.sum()))

    def _rows(self) -> Floats:
        """Return the mean speeds from each message to the next, (n - 1, 2): those of the arcs
        between the poses; where the poses were not filled in, the speeds.
        """
        if not np.ptp(self.poses, axis=0).any():
            return self.speeds[1:].copy()

        lasts_s = np.diff(self.stamps_ns) / NS_PER_S
        chords_m = np.diff(self.poses[:, :2], axis=0)
        turned_rad = wrap_angle(np.diff(self.poses[:, 2]))
        middle_rad = self.poses[:-1, 2] + turned_rad / 2
        ahead_m = chords_m[:, 0] * np.cos(middle_rad) + chords_m[:, 1] * np.sin(middle_rad)
        along_m = ahead_m / np.sinc(turned_rad / (2 * np.pi))
        return np.column_stack([along_m, turned_rad]) / lasts_s[:, None]


def read_odometry(bag: Bag, topic: str) -> tuple[Poses | None, list[str]]:
    """Return the odometry on a topic, None if it is not two messages, and sentences on what of it
    is left out. Raises UsageError if stamps are of two clocks.
    """
    stamps = []
    numbers = []
    for place, message in bag.messages(topic):
        stamps.append(place.stamp_ns)
        numbers.append([*pose_of(message.pose.pose), *speeds_of(message.twist.twist)])
    rows = np.array(numbers, np.float64).reshape(-1, 5)

    is_finite = np.isfinite(rows).all(axis=1)
    stamps_ns = np.array(stamps, np.int64)[is_finite]
    rows = rows[is_finite]
    notes = []
    if not is_finite.all():
        broken = int(np.count_nonzero(~is_finite))
        notes.append(f"{topic}: {broken} messages with numbers that are not finite are left out")

    order, notes_of_order = in_order(stamps_ns, f"{bag.path}: {topic}")
    notes += notes_of_order
    if len(order) < 2:
        return None, [*notes, f"{topic} has no two messages of odometry, and is left out"]
    return Poses(stamps_ns[order], rows[order, :3], rows[order, 3:]), notes


def pose_of(pose: Any) -> tuple[float, float, float]:
    """Return x_m, y_m and heading_rad of a Pose."""
    turn = pose.orientation
    across = turn.w * turn.z + turn.x * turn.y
    along = 0.5 - turn.y**2 - turn.z**2
    return pose.position.x, pose.position.y, float(np.arctan2(across, along))


def speeds_of(twist: Any) -> tuple[float, float]:
    """Return the speed ahead and the turn rate of a Twist, in m/s and rad/s."""
    return twist.linear.x, twist.angular.z


def _ends(stamps_ns: Indices, views_ns: Indices) -> Indices:
    """Return when motions begin and end: at stamps, at views in between, and within long gaps."""
    inside = views_ns[(views_ns > stamps_ns[0]) & (views_ns < stamps_ns[-1])]
    ends_ns = np.union1d(stamps_ns, inside)
    begins_ns = [
        np.arange(begin_ns, end_ns, LONGEST_NS) for begin_ns, end_ns in pairwise(ends_ns.tolist())
    ]
    return np.concatenate([*begins_ns, ends_ns[-1:]])
