"""The wheels' motion between two views, its uncertainty by itself and beside what was seen, and the
motion of both as rows of speeds. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.services.sensory.self_motion.motion import Motion
from cogmap.services.sensory.self_motion.visual_odometry import SCALE_SD

# Wheels that slipped are believed again after some seconds without it. A disagreement of more
# standard deviations than SURPRISE_SDS is no noise.
DOUBT_TIME_S = 5.0
SURPRISE_SDS = 3.0
# The size of wheels, as a share: by tyre pressure, load and wear. Distances shorter than
# MIN_SCALED_M measure no scale.
WHEEL_SIZE_SD = 0.01
MIN_SCALED_M = 0.05
# Speeds are stretched by no more than that share; what is missing beyond is spread over the time.
MAX_STRETCH = 0.5


@dataclass(frozen=True)
class WheelNoise:
    """Standard deviations: factors on both speeds, and drift of heading with the root of the
    distance.
    """

    speed: float
    turn: float
    drift_rad_per_sqrt_m: float

    def total(self, rows: Floats) -> Motion:
        """Return the sum of (n, 3) rows of speed, turn rate and duration."""
        speed_m_s, turn_rate_rad_s, dt_s = rows.T
        distance_m = speed_m_s * dt_s
        turn_rad = turn_rate_rad_s * dt_s

        distance_var_m2 = (self.speed * distance_m) ** 2
        drift_var_rad2 = self.drift_rad_per_sqrt_m**2 * np.abs(distance_m)
        factor_var_rad2 = (self.turn * turn_rad) ** 2
        turn_var_rad2 = factor_var_rad2 + drift_var_rad2

        return Motion(
            distance_m=float(distance_m.sum()),
            turn_rad=float(turn_rad.sum()),
            distance_sd_m=float(np.sqrt(distance_var_m2.sum())),
            turn_sd_rad=float(np.sqrt(turn_var_rad2.sum())),
        )


def contradict(one: Motion, other: Motion) -> bool:
    """Decide whether two motions differ by more than both may err."""
    distance_sd_m = math.hypot(one.distance_sd_m, other.distance_sd_m)
    turn_sd_rad = math.hypot(one.turn_sd_rad, other.turn_sd_rad)
    apart_m = abs(one.distance_m - other.distance_m)
    apart_rad = abs(one.turn_rad - other.turn_rad)
    return apart_m > SURPRISE_SDS * distance_sd_m or apart_rad > SURPRISE_SDS * turn_sd_rad


class WheelDoubt:
    """How much more wheels err than their noise says: they slip, or their sensor lies.

    The excess of the squared disagreements with the views over what both may err, averaged over
    the last seconds. A disagreement beyond all of that is not averaged first: the wheels are
    doubted by it at once.
    """

    def __init__(self) -> None:
        self._speed = _Excess()
        self._turn_rate = _Excess()

    def doubted(self, wheels: Motion, seen: Motion | None, dt_s: float) -> Motion:
        """Return the wheels' motion in `dt_s` with the standard deviations that it really has, as
        far as the views, if they measured one, have shown.
        """
        distance_var_m2 = wheels.distance_sd_m**2
        turn_var_rad2 = wheels.turn_sd_rad**2
        if seen is None:
            distance_var_m2 += self._speed.variance * dt_s**2
            turn_var_rad2 += self._turn_rate.variance * dt_s**2
        else:
            distance_var_m2 += dt_s**2 * self._speed.updated(
                (seen.distance_m - wheels.distance_m) / dt_s,
                (distance_var_m2 + seen.distance_sd_m**2) / dt_s**2,
                dt_s,
            )
            turn_var_rad2 += dt_s**2 * self._turn_rate.updated(
                (seen.turn_rad - wheels.turn_rad) / dt_s,
                (turn_var_rad2 + seen.turn_sd_rad**2) / dt_s**2,
                dt_s,
            )
        return replace(
            wheels,
            distance_sd_m=math.sqrt(distance_var_m2),
            turn_sd_rad=math.sqrt(turn_var_rad2),
        )


class _Excess:
    """The mean excess of squared disagreements over their variance."""

    def __init__(self) -> None:
        self._mean = 0.0

    @property
    def variance(self) -> float:
        """Return what the disagreements add to the variance of the wheels."""
        return max(0.0, self._mean)

    def updated(self, disagreement: float, variance: float, dt_s: float) -> float:
        """Count a disagreement of two whose variances add up to `variance`; return what to add to
        the wheels' own.
        """
        squared = disagreement**2
        gain = 1 - math.exp(-dt_s / DOUBT_TIME_S)
        self._mean += gain * (squared - variance - self._mean)
        if squared > SURPRISE_SDS**2 * (variance + self.variance):
            return max(squared, self.variance)
        return self.variance


class Scale:
    """The ratio of distances by the wheels to distances seen.

    The wheels' noise is of mean one (paper §5.4), but for the size of the wheels, so their mean
    ratio improves with every metre, whatever constant share the views get wrong.
    """

    def __init__(self) -> None:
        self._mean = 1.0
        self._information = 0.0

    def correct(self, seen: Motion, wheels: Motion) -> Motion:
        """Return what was seen, in metres that both agree on; while moving, the two improve the
        scale.
        """
        shortest_m = min(abs(seen.distance_m), abs(wheels.distance_m))
        if shortest_m > MIN_SCALED_M and wheels.distance_sd_m > 0.0:
            information = (seen.distance_m / wheels.distance_sd_m) ** 2
            self._information += information
            innovation = wheels.distance_m / seen.distance_m - self._mean
            self._mean += innovation * information / self._information
        if not self._information:
            return seen

        by_wheels_var = 1 / self._information + WHEEL_SIZE_SD**2
        weight = SCALE_SD**2 / (SCALE_SD**2 + by_wheels_var)
        return replace(seen, distance_m=seen.distance_m * (1 + weight * (self._mean - 1)))


def fuse(rows: Floats, motion: Motion, wheels: Motion) -> Floats:
    """Return the rows, (n, 5) with standard deviations of both speeds, adjusted to add up to
    `motion`.

    The wheels alone measure how the motion was spread over the time between the views.
    """
    if not len(rows):
        return np.zeros((0, 5))

    speed_m_s, turn_rate_rad_s, dt_s = rows.T
    missing_m = motion.distance_m - wheels.distance_m
    if abs(missing_m) < MAX_STRETCH * abs(wheels.distance_m):
        speed_m_s = speed_m_s * motion.distance_m / wheels.distance_m
    else:
        speed_m_s = speed_m_s + missing_m / dt_s.sum()

    turn_error_rad = motion.turn_rad - wheels.turn_rad
    turn_rate_rad_s = turn_rate_rad_s + turn_error_rad / dt_s.sum()

    share = 1 / (dt_s * np.sqrt(len(rows)))
    speed_sd_m_s = motion.distance_sd_m * share
    turn_rate_sd_rad_s = motion.turn_sd_rad * share

    return np.column_stack([speed_m_s, turn_rate_rad_s, dt_s, speed_sd_m_s, turn_rate_sd_rad_s])


def spread(motion: Motion, dt_s: float) -> Floats:
    """Return the rows, (2, 5) as those of `fuse`, of a motion that nothing measured in between: two
    arcs of one length, which lead where it leads.
    """
    first_rad = motion.turn_rad / 2 + 2 * motion.drift_rad
    second_rad = motion.turn_rad - first_rad
    # Each leads along half of its turn: by half of the whole turn apart from the other.
    speed_m_s = motion.distance_m / dt_s / math.cos(motion.turn_rad / 4)

    half_s = dt_s / 2
    share = 1 / (half_s * math.sqrt(2))
    sds = (motion.distance_sd_m * share, motion.turn_sd_rad * share)
    return np.array(
        [
            (speed_m_s, first_rad / half_s, half_s, *sds),
            (speed_m_s, second_rad / half_s, half_s, *sds),
        ]
    )
