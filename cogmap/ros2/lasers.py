"""Scans of a laser as they come, as views in which nothing is recognized. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cogmap.data.bags.mount import mount_by
from cogmap.data.bags.order import NS_PER_S
from cogmap.data.bags.scans import rays_of
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Odometry, Percepts, RangeScan, SelfMotion
from cogmap.services.player.public import Wheels


class ScanStream:
    """Scans as views, at most one in `period_ns`."""

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._next_ns = 0
        self._since_ns = 0

    def is_due(self, stamp_ns: int) -> bool:
        """Decide whether a scan becomes a view."""
        return stamp_ns >= self._next_ns

    def view(
        self,
        number: int,
        stamp_ns: int,
        scan: Any,
        moved: Sequence[Odometry],
        transforms: Mapping[str, Any],
    ) -> list[Message]:
        """Return view `number`: the self-motion since the scan before, the rays as the robot sees
        them, and that nothing is recognized. The laser stands as the static `transforms` say.
        """
        since_ns = self._since_ns or stamp_ns
        self._since_ns = stamp_ns
        self._next_ns = stamp_ns + self._period_ns

        rays = rays_of(scan, mount_by(transforms, scan.header.frame_id))
        motion = SelfMotion(
            stamp_ns=stamp_ns, frame=number, since_ns=since_ns, motions=Array.of(_rows(moved))
        )
        ranges = RangeScan(
            stamp_ns=stamp_ns,
            frame=number,
            bearing_rad=Array.of(rays[:, 0], "<f4"),
            range_m=Array.of(rays[:, 1], "<f4"),
        )
        no_points = Array.of(np.zeros((0, 2), np.float32))
        seen = Percepts(stamp_ns=stamp_ns, frame=number, objects=[], road_m=no_points)
        return [motion, ranges, seen]


def _rows(moved: Sequence[Odometry]) -> Any:
    """Return motions as rows of self-motion (n, 5), with the noise of uncalibrated wheels."""
    if not moved:
        return np.empty((0, 5))

    begin_s = moved[0].stamp_ns / NS_PER_S - moved[0].dt_s
    ends_s = [each.stamp_ns / NS_PER_S for each in moved]
    speeds = [(each.speed_m_s, each.turn_rate_rad_s) for each in moved]
    table = np.column_stack([[begin_s, *ends_s], [*speeds, (0.0, 0.0)]])
    return Wheels(table).rows(begin_s, ends_s[-1])
