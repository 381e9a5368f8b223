"""Backs away from what a robot stands before, so that it can take another way. Pure."""

from __future__ import annotations

import msgspec

from cogmap.robot import WHEEL_RADIUS_M
from cogmap.schemas.sensing import MotorCommand, SpeedLimit

# How long the robot waits before an obstacle; how long and fast it backs away, 0.8 m in all.
HALTED_S = 2.0
BACK_S = 2.0
BACK_M_S = 0.4


class Escape:
    """Lets the robot back away for BACK_S if it is stuck, or was halted by an obstacle for
    HALTED_S.

    It came from there, so that the ground behind it is free; a new plan leads round what the scan
    has put on the map meanwhile.
    """

    def __init__(self) -> None:
        self._halted_since_ns: int | None = None
        self._until_ns = -1

    def command(self, wanted: MotorCommand, is_stuck: bool) -> MotorCommand:
        """Replace the wanted command while the robot is to back away; else return it."""
        now_ns = wanted.stamp_ns
        if wanted.halted_by is not SpeedLimit.OBSTACLE:
            self._halted_since_ns = None
        elif self._halted_since_ns is None or self._halted_since_ns > now_ns:
            self._halted_since_ns = now_ns

        since_ns = self._halted_since_ns
        has_waited = since_ns is not None and now_ns - since_ns >= HALTED_S * 1e9
        back_ns = round(BACK_S * 1e9)
        if is_stuck or has_waited:
            self._until_ns = now_ns + back_ns
            self._halted_since_ns = None
        if not 0 < self._until_ns - now_ns <= back_ns:
            return wanted

        return msgspec.structs.replace(
            wanted,
            left_wheel_rad_s=-BACK_M_S / WHEEL_RADIUS_M,
            right_wheel_rad_s=-BACK_M_S / WHEEL_RADIUS_M,
            halted_by=SpeedLimit.NONE,
            slowed_by=SpeedLimit.STUCK if is_stuck else SpeedLimit.OBSTACLE,
        )
