"""Finds out that the robot stands although it is commanded to move. Pure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.errors import MessageError
from cogmap.schemas.sensing import SelfMotion

MIN_COMMANDED = 3.0
MIN_TURN_RAD_S = 0.05


class Speeds(NamedTuple):
    """Mean speed and mean turn rate over some time, both without sign."""

    speed_m_s: float
    turn_rad_s: float


class StuckDetector:
    """The robot is stuck when it has been slower than `stuck_m_s` for `after_s`, while the commands
    were MIN_COMMANDED times as fast at least.
    """

    def __init__(self, stuck_m_s: float, after_s: float) -> None:
        self._stuck_m_s = stuck_m_s
        self._after_ns = round(after_s * 1e9)
        self._commanded_m_s = 0.0
        self._standing_since_ns: int | None = None
        self.is_stuck = False

    def on_command(self, speed_m_s: float) -> None:
        """The robot was commanded to move at `speed_m_s`; the motions that follow are compared with
        it.
        """
        self._commanded_m_s = speed_m_s

    def on_motion(self, motion: SelfMotion) -> None:
        """Compare a self-motion with the last command. Raises MessageError where its rows are not
        of five columns.
        """
        if self._is_moving(motion) or not self._is_commanded:
            self._standing_since_ns = None
        elif self._standing_since_ns is None:
            self._standing_since_ns = motion.since_ns

        since_ns = self._standing_since_ns
        if since_ns is None:
            self.is_stuck = False
        else:
            self.is_stuck = motion.stamp_ns - since_ns >= self._after_ns

    @property
    def _is_commanded(self) -> bool:
        return self._commanded_m_s >= MIN_COMMANDED * self._stuck_m_s

    def _is_moving(self, motion: SelfMotion) -> bool:
        speeds = _mean_speeds(motion)
        is_travelling = speeds.speed_m_s >= self._stuck_m_s
        is_turning = speeds.turn_rad_s >= MIN_TURN_RAD_S

        return is_travelling or is_turning


def _mean_speeds(motion: SelfMotion) -> Speeds:
    shape = motion.motions.shape
    if len(shape) != 2 or shape[1] != 5:
        raise MessageError(f"self-motion: expected rows of 5 columns, got an array of {shape}")

    rows = np.asarray(motion.motions.numpy(), float)
    duration_s = float(rows[:, 2].sum())
    if duration_s <= 0.0:
        return Speeds(0.0, 0.0)

    speed_m_s, turn_rate_rad_s, dt_s = rows[:, :3].T
    distance_m = float(np.abs(speed_m_s * dt_s).sum())
    turn_rad = float(np.abs(turn_rate_rad_s * dt_s).sum())

    return Speeds(distance_m / duration_s, turn_rad / duration_s)
