"""An MRCLAM robot's log as the percepts and self-motion that sensory memory and EPAM publish."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.localization.delay import Delay
from cogmap.data.mrclam import Robot
from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Percept
from cogmap.services.sensory.module import Config as SensoryConfig

TICK_S = 0.2
STAMP_DECIMALS = 6
RANGE_NOISE = 0.03
BEARING_SD_RAD = float(np.deg2rad(1.0))
MIN_COSINE = 0.1
NOISE = SensoryConfig()


@dataclass(frozen=True)
class Moment:
    """What was sensed up to `stamp_s`: (n, 5) rows of self-motion as in SelfMotion, and percepts.

    `tick` is True at even times, False where it is one only because something was seen.
    """

    stamp_s: float
    motions: Floats
    percepts: list[Percept]
    tick: bool


def label_of(subject: int) -> str:
    """What EPAM would call a landmark."""
    return f"landmark-{subject}"


def seen(label: str, bearing_rad: float, range_m: float) -> Percept:
    """A percept with the benchmark's noise: 3 % of the distance, as the paper's, and 1°."""
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
    """An observation (stamp, subject, range, bearing) as a percept.

    What a set calls range is how high an upright barcode looks, which is its depth along the
    camera's axis.
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

        turn_rates = odometry[:-1, 2]
        turns = turn_rates * np.diff(self._stamps)
        turned = np.cumsum(turns)
        self._turned = np.concatenate([[0.0], turned])

    def heading_rad(self, stamps_s: Floats) -> Floats:
        """What the turns add up to at each of `stamps_s`."""
        heading: Floats = np.interp(stamps_s, self._stamps, self._turned)
        return heading

    def rows(self, since_s: float, until_s: float) -> Floats:
        """(n, 5) rows of self-motion, one for each time that the command changed in between."""
        begin_s = max(since_s, float(self._stamps[0]))
        if until_s <= begin_s:
            return np.empty((0, 5))

        speeds, lasts_s = self._commands(since_s, begin_s, until_s)
        speed, turn_rate = speeds.T
        magnitude = np.abs(speed)
        speed_sd = NOISE.speed_noise * magnitude / np.sqrt(lasts_s)

        drift_variance = NOISE.drift_rad_per_sqrt_m**2 * magnitude
        rate_sd = NOISE.turn_noise * turn_rate
        turn_variance = rate_sd**2 + drift_variance
        turn_sd = np.sqrt(turn_variance / lasts_s)
        return np.column_stack([speed, turn_rate, lasts_s, speed_sd, turn_sd])

    def _commands(self, since_s: float, begin_s: float, until_s: float) -> tuple[Floats, Floats]:
        """The speeds (n, 2) commanded in between, equal ones in a row as one, and how long each
        lasts.
        """
        after = int(np.searchsorted(self._stamps, since_s, "right"))
        first = max(0, after - 1)
        last = int(np.searchsorted(self._stamps, until_s, "left"))
        speeds = self._speeds[first:last]
        starts_s = np.append(begin_s, self._stamps[first + 1 : last])

        differs = speeds[1:] != speeds[:-1]
        is_change = np.append(True, differs.any(axis=1))
        changes = np.flatnonzero(is_change)
        edges_s = np.append(starts_s[changes], until_s)
        lasts_s = np.diff(edges_s)

        some = lasts_s > 0
        return speeds[changes[some]], lasts_s[some]


def moments(robot: Robot, skipped_s: tuple[float, float] | None = None) -> Iterator[Moment]:
    """A robot's log in order of time, observations of other robots left out.

    Between `skipped_s`, seconds after its start, nothing reaches it: it is kidnapped.
    """
    begin_s = float(robot.odometry[0, 0])
    end_s = float(robot.odometry[-1, 0])
    observed = _observed(robot, begin_s, end_s)
    ticks = np.arange(begin_s + TICK_S, end_s, TICK_S).round(STAMP_DECIMALS)
    stamps = np.union1d(ticks, observed[:, 0])
    is_tick = np.isin(stamps, ticks)

    wheels = Wheels(robot.odometry)
    delay = Delay()
    moved_until_s = begin_s

    for stamp_s, tick in zip(stamps.tolist(), is_tick.tolist(), strict=True):
        here = _at(observed, stamp_s)
        delay.observe(here, wheels.heading_rad)
        sensed_s = max(moved_until_s, stamp_s - delay.lag_s)

        if not _is_within(stamp_s - begin_s, skipped_s):
            motions = wheels.rows(moved_until_s, sensed_s)
            yield Moment(stamp_s, motions, _percepts(here), tick)

        moved_until_s = sensed_s


def _observed(robot: Robot, begin_s: float, end_s: float) -> Floats:
    """The observations of landmarks in that time, their stamps rounded as those of ticks are."""
    every = robot.landmark_observations
    stamps_s = every[:, 0]
    is_during = (stamps_s > begin_s) & (stamps_s <= end_s)

    observed = every[is_during]
    observed[:, 0] = observed[:, 0].round(STAMP_DECIMALS)
    return observed


def _at(observed: Floats, stamp_s: float) -> Floats:
    """The rows of that stamp; they are in order of time."""
    stamps_s = observed[:, 0]
    first = np.searchsorted(stamps_s, stamp_s, "left")
    last = np.searchsorted(stamps_s, stamp_s, "right")
    return observed[first:last]


def _is_within(time_s: float, limits_s: tuple[float, float] | None) -> bool:
    if limits_s is None:
        return False

    begin_s, end_s = limits_s
    return begin_s <= time_s < end_s


def _percepts(rows: Floats) -> list[Percept]:
    """One percept for each landmark: of two barcodes read at once under one name, the first."""
    found: dict[int, Percept] = {}

    for row in rows:
        subject = int(row[1])
        found.setdefault(subject, percept_of(row))

    return list(found.values())
