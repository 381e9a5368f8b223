"""An MRCLAM robot's log as the percepts and self-motion that sensory memory and EPAM publish."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cogmap.data.mrclam import Robot
from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Percept
from cogmap.services.player.public import Delay, WheelNoise, Wheels, sighting
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
    return sighting(
        label,
        bearing_rad,
        range_m,
        bearing_sd_rad=BEARING_SD_RAD,
        range_sd_m=RANGE_NOISE * range_m,
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

    noise = WheelNoise(NOISE.speed_noise, NOISE.turn_noise, NOISE.drift_rad_per_sqrt_m)
    wheels = Wheels(robot.odometry, noise)
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
