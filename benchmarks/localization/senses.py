"""An MRCLAM robot's log as the percepts and self-motion that sensory memory and EPAM publish."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.localization.delay import Delay
from cogmap.data.mrclam import Robot
from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Percept
from cogmap.services.sensory.public import SensoryConfig

TICK_S = 0.2
STAMP_DECIMALS = 6
RANGE_NOISE = 0.03
BEARING_SD_RAD = float(np.deg2rad(1.0))
MIN_COSINE = 0.1
NOISE = SensoryConfig()


@dataclass(frozen=True)
class Moment:
    """The sensing up to `stamp_s`: (n, 5) rows of self-motion as in SelfMotion, and percepts.

    `tick` is True at even times, False where it is one only because something was seen.
    """

    stamp_s: float
    motions: Floats
    percepts: list[Percept]
    tick: bool


def label_of(subject: int) -> str:
    """Return EPAM's label of a landmark."""
    return f"landmark-{subject}"


def seen(label: str, bearing_rad: float, range_m: float) -> Percept:
    """Make a percept with the benchmark's noise: 3 % of the distance, as the paper's, and 1°."""
    return Percept(
        label=label,
        activation=1.0,
        evidence=1.0,
        bearing_rad=bearing_rad,
        range_m=range_m,
        bearing_sd_rad=BEARING_SD_RAD,
        range_sd_m=RANGE_NOISE * range_m,
        width_m=0.0,
        height_m=0.0,
        whole=True,
        box_px=(0, 0, 0, 0),
    )


def percept_of(row: Floats) -> Percept:
    """Make a percept of an observation (stamp, subject, range, bearing).

    The range of a set is computed from the height of an upright barcode in the image: it is the
    depth along the camera's axis.
    """
    _, subject, depth_m, bearing_rad = row.tolist()
    label = label_of(int(subject))
    cosine = max(float(np.cos(bearing_rad)), MIN_COSINE)
    return seen(label, bearing_rad, depth_m / cosine)


class Wheels:
    """The odometry's commands as self-motion, with the noise that sensory memory gives the town's.

    The paper's noise multiplies the speeds of a movement: here of a second's, so that the rate of
    the log does not matter.
    """

    def __init__(self, odometry: Floats) -> None:
        self._stamps = odometry[:, 0]
        self._speeds = odometry[:, 1:3]

        turns = odometry[:-1, 2] * np.diff(self._stamps)
        self._turned = np.concatenate([[0.0], np.cumsum(turns)])

    def heading_rad(self, stamps_s: Floats) -> Floats:
        """Return the sum of the turns at each of `stamps_s`."""
        heading: Floats = np.interp(stamps_s, self._stamps, self._turned)
        return heading

    def rows(self, since_s: float, until_s: float) -> Floats:
        """Return (n, 5) rows of self-motion, one for each change of the command in between."""
        begin_s = max(since_s, float(self._stamps[0]))
        if until_s <= begin_s:
            return np.empty((0, 5))

        # The commands in between, and since when each holds; equal ones in a row are one.
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
        speed_sd = NOISE.speed_noise * magnitude / np.sqrt(lasts_s)

        drift_variance = NOISE.drift_rad_per_sqrt_m**2 * magnitude
        rate_sd = NOISE.turn_noise * turn_rate
        turn_variance = rate_sd**2 + drift_variance
        turn_sd = np.sqrt(turn_variance / lasts_s)
        return np.column_stack([speed, turn_rate, lasts_s, speed_sd, turn_sd])


def moments(robot: Robot, skipped_s: tuple[float, float] | None = None) -> Iterator[Moment]:
    """Yield a robot's log in order of time, without observations of other robots.

    Between `skipped_s`, seconds after its start, nothing reaches it: it is kidnapped.
    """
    begin_s, end_s = robot.odometry[[0, -1], 0].tolist()
    every = robot.landmark_observations
    observed = every[(every[:, 0] > begin_s) & (every[:, 0] <= end_s)]
    observed[:, 0] = observed[:, 0].round(STAMP_DECIMALS)

    ticks = np.arange(begin_s + TICK_S, end_s, TICK_S).round(STAMP_DECIMALS)
    stamps = np.union1d(ticks, observed[:, 0])
    is_tick = np.isin(stamps, ticks)
    firsts = np.searchsorted(observed[:, 0], stamps, "left")
    ends = np.searchsorted(observed[:, 0], stamps, "right")

    wheels = Wheels(robot.odometry)
    delay = Delay()
    moved_until_s = begin_s

    for stamp_s, tick, first, end in zip(
        stamps.tolist(), is_tick.tolist(), firsts.tolist(), ends.tolist(), strict=True
    ):
        here = observed[first:end]
        delay.observe(here, wheels.heading_rad)
        sensed_s = max(moved_until_s, stamp_s - delay.lag_s)

        if skipped_s is None or not skipped_s[0] <= stamp_s - begin_s < skipped_s[1]:
            # Of two barcodes read at once under one name, the first.
            percepts: dict[int, Percept] = {}
            for row in here:
                percepts.setdefault(int(row[1]), percept_of(row))

            motions = wheels.rows(moved_until_s, sensed_s)
            yield Moment(stamp_s, motions, list(percepts.values()), tick)

        moved_until_s = sensed_s
