"""A log's odometry as self-motion between any two of its times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats


class WheelNoise(NamedTuple):
    """Standard deviations: shares of speed and turn rate, as those of a movement of a second, and
    drift of heading with the root of the distance.

    The paper's noise multiplies the speeds of a movement: here of a second's, so that the rate of
    the log does not matter.
    """

    speed: float
    turn: float
    drift_rad_per_sqrt_m: float


UNCALIBRATED = WheelNoise(speed=0.1, turn=0.1, drift_rad_per_sqrt_m=0.02)
"""Of wheels that nobody has calibrated: the paper's (section 5.4), and what sensory memory takes a
heading to drift by.
"""


class Wheels:
    """The speeds that a log holds, each from its stamp until the next, as self-motion.

    `odometry`: (n, 3) stamp in s, speed in m/s, turn rate in rad/s, in order of time.
    """

    def __init__(self, odometry: Floats, noise: WheelNoise = UNCALIBRATED) -> None:
        self._noise = noise
        self._stamps = odometry[:, 0]
        self._speeds = odometry[:, 1:3]

        turns = odometry[:-1, 2] * np.diff(self._stamps)
        self._turned = np.concatenate([[0.0], np.cumsum(turns)])

    def heading_rad(self, stamps_s: Floats) -> Floats:
        """Return the sum of the turns at each of `stamps_s`."""
        heading: Floats = np.interp(stamps_s, self._stamps, self._turned)
        return heading

    def rows(self, since_s: float, until_s: float) -> Floats:
        """Return (n, 5) rows of self-motion, one for each change of the speeds in between."""
        begin_s = max(since_s, float(self._stamps[0]))
        if until_s <= begin_s:
            return np.empty((0, 5))

        # The speeds in between, and since when each holds; equal ones in a row are one.
        first = max(0, int(np.searchsorted(self._stamps, since_s, "right")) - 1)
        last = int(np.searchsorted(self._stamps, until_s, "left"))
        commands = self._speeds[first:last]
        starts_s = np.append(begin_s, self._stamps[first + 1 : last])
        differs = (commands[1:] != commands[:-1]).any(axis=1)
        changes = np.flatnonzero(np.append(True, differs))

        lasts_s = np.diff(np.append(starts_s[changes], until_s))
        some = lasts_s > 0
        lasts_s = lasts_s[some]
        speed, turn_rate = commands[changes[some]].T
        magnitude = np.abs(speed)
        speed_sd = self._noise.speed * magnitude / np.sqrt(lasts_s)

        drift_variance = self._noise.drift_rad_per_sqrt_m**2 * magnitude
        rate_sd = self._noise.turn * turn_rate
        turn_variance = rate_sd**2 + drift_variance
        turn_sd = np.sqrt(turn_variance / lasts_s)
        return np.column_stack([speed, turn_rate, lasts_s, speed_sd, turn_sd])
