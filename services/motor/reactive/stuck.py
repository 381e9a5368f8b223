"""Finds out that the robot stands although it is commanded to move. Pure."""

from __future__ import annotations

import numpy as np

from cogmap.errors import MessageError
from cogmap.schemas.sensing import SelfMotion

# A slower robot stands. It is stuck only if it is commanded to drive three times as fast as that,
# and does not turn on the spot either.
STUCK_M_S = 0.1
MIN_COMMANDED_M_S = 3 * STUCK_M_S
MIN_TURN_RAD_S = 0.05


class StuckDetector:
    """Takes the robot for stuck when it has been slower than STUCK_M_S for `after_s`, while it was
    commanded to drive at MIN_COMMANDED_M_S at least.
    """

    def __init__(self, after_s: float) -> None:
        self._after_ns = round(after_s * 1e9)
        self._commanded_m_s = 0.0
        self._standing_since_ns: int | None = None
        self.is_stuck = False

    def on_command(self, speed_m_s: float) -> None:
        """Note that the robot was commanded to move at `speed_m_s`; the motions that follow are
        compared with it.
        """
        self._commanded_m_s = speed_m_s

    def on_motion(self, motion: SelfMotion) -> None:
        """Compare a self-motion with the last command. Raises MessageError if its rows are not of
        five columns.
        """
        shape = motion.motions.shape
        if len(shape) != 2 or shape[1] != 5:
            raise MessageError(f"self-motion: expected rows of 5 columns, got an array of {shape}")

        speed_m_s, turn_rad_s, dt_s = np.asarray(motion.motions.numpy(), float)[:, :3].T
        duration_s = float(dt_s.sum())
        distance_m = float(np.abs(speed_m_s * dt_s).sum())
        turn_rad = float(np.abs(turn_rad_s * dt_s).sum())
        is_travelling = distance_m >= STUCK_M_S * duration_s
        is_turning = turn_rad >= MIN_TURN_RAD_S * duration_s
        is_moving = duration_s > 0.0 and (is_travelling or is_turning)

        if is_moving or self._commanded_m_s < MIN_COMMANDED_M_S:
            self._standing_since_ns = None
        elif self._standing_since_ns is None or self._standing_since_ns > motion.since_ns:
            self._standing_since_ns = motion.since_ns

        since_ns = self._standing_since_ns
        self.is_stuck = since_ns is not None and motion.stamp_ns - since_ns >= self._after_ns
