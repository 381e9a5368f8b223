"""An MRCLAM robot's log as percepts and self-motion: what EPAM and sensory memory are to the town's
agent.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.localization.delay import Delay
from cogmap.data.mrclam import Robot
from cogmap.geometry.arrays import Floats
from schemas.sensing import Percept
from services.sensory.module import Config as SensoryConfig

TICK_S = 0.2
RANGE_NOISE = 0.03
BEARING_SD_RAD = np.deg2rad(1.0)
WHEELS = SensoryConfig()


@dataclass(frozen=True)
class Moment:
    """What came in up to `stamp_s`: rows of self-motion as in SelfMotion, and percepts; `tick`
    comes at even times.
    """

    stamp_s: float
    motions: Floats
    percepts: list[Percept]
    tick: bool


def label_of(subject: int) -> str:
    """What EPAM would call a landmark."""
    return f"landmark-{subject}"


def percept_of(row: Floats) -> Percept:
    """A sighting (stamp, subject, range, bearing) as a percept: noise 3 % of the distance, as the
    paper's, and 1°.

    What a set calls range is how high an upright barcode looks, which is its depth along the
    camera's axis.
    """
    depth_m = float(row[2])
    bearing_rad = float(row[3])
    range_m = depth_m / max(np.cos(bearing_rad), 0.1)
    return Percept(
        label=label_of(int(row[1])),
        activation=1.0,
        bearing_rad=bearing_rad,
        range_m=range_m,
        bearing_sd_rad=float(BEARING_SD_RAD),
        range_sd_m=RANGE_NOISE * range_m,
        width_m=0.0,
        height_m=0.0,
        whole=True,
        box_px=(0, 0, 0, 0),
    )


class Wheels:
    """The odometry's commands as self-motion, with the noise that the town's sensory memory gives
    its own wheels.

    The paper's noise multiplies the speeds of a movement: here of a second's, so that the rate of
    the log does not matter.
    """

    def __init__(self, odometry: Floats) -> None:
        self._stamps = odometry[:, 0]
        self._speeds = odometry[:, 1:3]
        turned = np.concatenate([[0.0], np.cumsum(odometry[:-1, 2] * np.diff(self._stamps))])
        self._turned = turned

    def heading_rad(self, stamps_s: Floats) -> Floats:
        """What the turns add up to at each of `stamps_s`."""
        heading: Floats = np.interp(stamps_s, self._stamps, self._turned)
        return heading

    def rows(self, since_s: float, until_s: float) -> Floats:
        """(n, 5) rows of self-motion, one for each time that the command changed in between."""
        first = max(0, int(np.searchsorted(self._stamps, since_s, "right")) - 1)
        last = int(np.searchsorted(self._stamps, until_s, "left"))
        if until_s <= max(since_s, self._stamps[0]):
            return np.empty((0, 5))
        speeds = self._speeds[first:last]
        edges = np.concatenate(
            [[max(since_s, self._stamps[0])], self._stamps[first + 1 : last], [until_s]]
        )
        begins = np.flatnonzero(np.append(True, (speeds[1:] != speeds[:-1]).any(axis=1)))
        lasts_s = np.diff(np.append(edges[begins], until_s))
        begins = begins[lasts_s > 0]
        lasts_s = lasts_s[lasts_s > 0]
        speed, turn_rate = speeds[begins].T
        speed_sd = WHEELS.speed_noise * np.abs(speed) / np.sqrt(lasts_s)
        drift_var = WHEELS.drift_rad_per_sqrt_m**2 * np.abs(speed)
        turn_sd = np.sqrt(((WHEELS.turn_noise * turn_rate) ** 2 + drift_var) / lasts_s)
        return np.column_stack([speed, turn_rate, lasts_s, speed_sd, turn_sd])


def moments(robot: Robot, skipped_s: tuple[float, float] | None = None) -> Iterator[Moment]:
    """A robot's log in order of time, sightings of other robots left out.

    Between `skipped_s`, seconds after its start, nothing reaches it: it is carried away.
    """
    begin_s = float(robot.odometry[0, 0])
    end_s = float(robot.odometry[-1, 0])
    seen = robot.landmark_observations
    seen = seen[(seen[:, 0] > begin_s) & (seen[:, 0] <= end_s)]
    ticks = np.arange(begin_s + TICK_S, end_s, TICK_S)
    stamps = np.union1d(ticks, seen[:, 0])
    is_tick = np.isin(stamps, ticks)
    wheels = Wheels(robot.odometry)
    delay = Delay()
    moved_until_s = begin_s
    for stamp, tick in zip(stamps.tolist(), is_tick.tolist(), strict=True):
        here = seen[
            np.searchsorted(seen[:, 0], stamp, "left") : np.searchsorted(seen[:, 0], stamp, "right")
        ]
        delay.see(here, wheels.heading_rad)
        sensed_s = max(moved_until_s, stamp - delay.lag_s)
        if skipped_s is not None and skipped_s[0] <= stamp - begin_s < skipped_s[1]:
            moved_until_s = sensed_s
            continue
        yield Moment(stamp, wheels.rows(moved_until_s, sensed_s), _percepts(here), tick)
        moved_until_s = sensed_s


def _percepts(rows: Floats) -> list[Percept]:
    """One percept for each landmark: of two barcodes read at once under one name, the first."""
    found: dict[int, Percept] = {}
    for row in rows:
        found.setdefault(int(row[1]), percept_of(row))
    return list(found.values())
