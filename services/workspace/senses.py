"""Keeps what is sensed beside percepts until the cycle of its view needs it: self-motion, range
scans and what the body senses of itself.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from cogmap.errors import MessageError
from cogmap.runtime.codelet import CycleContext
from cogmap.runtime.run import Run
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.nodes import ENERGY, Need, need_id
from cogmap.schemas.sensing import Energy, Percepts, RangeScan, SelfMotion

M = TypeVar("M", bound=Message)
# Speed, turn rate, duration, and the standard deviations of the two speeds.
SELF_MOTION_COLUMNS = 5
# Bounds: all self-motion that is to be had after a restart; what else came in the last three
# seconds, at five views a second. The first that came is left out, not the earliest: stamps that
# lie ahead would stay.
MAX_MOTIONS = 1024
MAX_SCANS = 16
MAX_ENERGIES = 16
MAX_SCAN_AGE_NS = 100_000_000
"""In real time, how much older than its view a scan may be: half of the time between two views."""
CLOCK_PERIOD_NS = round(1e9 / topics.CLOCK.rate_hz)
SCANNERS = ("sim", "player", "sensory")
"""The modules that publish range scans: of percept-level sensing, and of cameras."""


class SelfMotions:
    """The self-motion that has not moved the self node yet, in order of its coming."""

    def __init__(self) -> None:
        self._motions: list[SelfMotion] = []
        self._was_earlier = False

    def put(self, motion: SelfMotion, moved_ns: int) -> None:
        """Keep self-motion, once, if it is newer than `moved_ns`.

        Two in succession that are earlier than the newest show that this one lies ahead of time:
        none that is later than the second is kept. Raises MessageError if its rows are of another
        shape or dtype.
        """
        shape = motion.motions.shape
        dtype = motion.motions.dtype
        has_columns = len(shape) == 2 and shape[1] == SELF_MOTION_COLUMNS
        if dtype != "<f8" or not has_columns:
            raise MessageError(f"self-motion of shape {shape} and dtype {dtype}")

        is_earlier = motion.stamp_ns < self.newest_ns()
        if is_earlier and self._was_earlier:
            self._motions = [known for known in self._motions if known.stamp_ns <= motion.stamp_ns]
        self._was_earlier = is_earlier

        stamps_ns = [known.stamp_ns for known in self._motions]
        is_new = motion.stamp_ns > moved_ns and motion.stamp_ns not in stamps_ns
        if is_new:
            self._motions.append(motion)
            self._motions = self._motions[-MAX_MOTIONS:]

    def newest_ns(self) -> int:
        """Return until when the motion is known; -1 if none is kept."""
        return max((motion.stamp_ns for motion in self._motions), default=-1)

    def rows(self, moved_ns: int, stamp_ns: int) -> Array:
        """Return the rows from `moved_ns` up to `stamp_ns`, float64 (n, 5)."""
        rows = [np.zeros((0, SELF_MOTION_COLUMNS))]
        for motion in self._motions:
            is_due = motion.since_ns >= moved_ns and motion.stamp_ns <= stamp_ns
            if is_due:
                values = motion.motions.numpy()
                rows.append(np.asarray(values, np.float64))

        return Array.of(np.vstack(rows), "<f8")

    def discard(self, moved_ns: int) -> None:
        """Discard what has moved the self node, up to `moved_ns`."""
        self._motions = [motion for motion in self._motions if motion.stamp_ns > moved_ns]


class Scans:
    """The newest range scans, of which each cycle takes the one of its view.

    In lockstep a cycle does not begin before it has come; if no module takes part that publishes
    scans, none is used. In real time it waits for it, where scans have come before, until the clock
    has passed the view: messages on different topics may overtake each other. Then it begins with
    the newest that is at most MAX_SCAN_AGE_NS older than its view, or with none.
    """

    def __init__(self, run: Run) -> None:
        has_scanner = run.has_any(*SCANNERS)
        self._is_lockstep = run.lockstep
        self._ignored = run.lockstep and not has_scanner
        self._max_age_ns = 0 if run.lockstep else MAX_SCAN_AGE_NS
        self._scans: dict[int, RangeScan] = {}
        self._missed_ns = -1

    def put(self, scan: RangeScan) -> None:
        """Keep a scan. Raises MessageError if it is of another shape or dtype, has a range
        below 0, or comes after the cycle of its view has begun without it.
        """
        bearing_rad = scan.bearing_rad
        range_m = scan.range_m
        is_flat = len(bearing_rad.shape) == 1 and bearing_rad.shape == range_m.shape
        if not is_flat or {bearing_rad.dtype, range_m.dtype} != {"<f4"}:
            raise MessageError(
                f"range scan of shapes {bearing_rad.shape}, {range_m.shape} "
                f"and dtypes {bearing_rad.dtype}, {range_m.dtype}"
            )

        ranges_m = np.asarray(range_m.numpy(), np.float32)
        if (ranges_m < 0).any():
            raise MessageError(f"range scan with a range of {ranges_m.min():g} m")
        if self._ignored:
            return
        if scan.stamp_ns == self._missed_ns:
            raise MessageError("a range scan came after its view's cycle had begun without it")

        _put_last(self._scans, scan, MAX_SCANS)

    def has(self, stamp_ns: int, now_ns: int) -> bool:
        """Decide whether the cycle of the view at `stamp_ns` waits for its scan no longer."""
        if stamp_ns in self._scans or self._ignored:
            return True
        if self._is_lockstep:
            return False
        # A clock that lags further behind the views would have every one wait.
        is_moment_of_view = stamp_ns - CLOCK_PERIOD_NS <= now_ns <= stamp_ns
        return not self._scans or not is_moment_of_view

    def take(self, stamp_ns: int) -> RangeScan | None:
        """Take the scan for the cycle of the view at `stamp_ns`; None if there is none."""
        until_view = [known_ns for known_ns in self._scans if known_ns <= stamp_ns]
        newest_ns = max(until_view, default=-1)
        is_missed = newest_ns != stamp_ns
        self._missed_ns = stamp_ns if is_missed else -1

        is_too_old = stamp_ns - newest_ns > self._max_age_ns
        if newest_ns < 0 or is_too_old:
            return None
        return self._scans[newest_ns]


class Body:
    """The newest of what the body sensed, of which each cycle takes that of its view.

    In lockstep a cycle does not begin before it has come, if the robot has a battery.
    """

    def __init__(self, run: Run) -> None:
        self._awaited = run.lockstep and run.energy
        self._sensed: dict[int, Energy] = {}

    def put(self, energy: Energy) -> None:
        """Keep what was sensed with a view."""
        _put_last(self._sensed, energy, MAX_ENERGIES)

    def has(self, stamp_ns: int) -> bool:
        """Decide whether the cycle of the view at `stamp_ns` waits for its energy no longer."""
        return not self._awaited or stamp_ns in self._sensed

    def needs(self, stamp_ns: int, cycle: int) -> list[Need]:
        """Return the needs at the view at `stamp_ns`; none if none is sensed, or only later."""
        until_view = [known_ns for known_ns in self._sensed if known_ns <= stamp_ns]
        if not until_view:
            return []

        energy = self._sensed[max(until_view)]
        level = 1.0 - energy.level
        need = Need(
            id=need_id(ENERGY),
            label=ENERGY,
            activation=level,
            cycle=cycle,
            level=level,
            is_eased=energy.is_charging,
        )
        return [need]


def _put_last(kept: dict[int, M], message: M, limit: int) -> None:
    """Keep a message by its stamp, and leave out the first that came of more than `limit`."""
    kept.pop(message.stamp_ns, None)
    kept[message.stamp_ns] = message
    while len(kept) > limit:
        del kept[next(iter(kept))]


class Sensed:
    """Self-motion, range scans, and what the body senses of itself. `moved_ns` is the time until
    when self-motion has moved the self node.
    """

    def __init__(self, run: Run) -> None:
        self._motions = SelfMotions()
        self._scans = Scans(run)
        self._body = Body(run)

    def put_motion(self, motion: SelfMotion, moved_ns: int) -> None:
        """Keep self-motion. Raises MessageError if its rows are of another shape or dtype."""
        self._motions.put(motion, moved_ns)

    def put_scan(self, scan: RangeScan) -> None:
        """Keep a range scan. Raises MessageError if it is none, or too late."""
        self._scans.put(scan)

    def put_energy(self, energy: Energy) -> None:
        """Keep the body's energy."""
        self._body.put(energy)

    def is_complete(self, stamp_ns: int, moved_ns: int, now_ns: int) -> bool:
        """Decide whether all that the cycle of the view at `stamp_ns` waits for has come, while the
        clock shows `now_ns`.
        """
        has_motion = max(self._motions.newest_ns(), moved_ns) >= stamp_ns
        return has_motion and self._scans.has(stamp_ns, now_ns) and self._body.has(stamp_ns)

    def motions(self, stamp_ns: int, moved_ns: int) -> Array:
        """Return the motions since the self node was moved last, up to `stamp_ns`."""
        return self._motions.rows(moved_ns, stamp_ns)

    def needs(self, stamp_ns: int, cycle: int) -> list[Need]:
        """Return the body's needs at the view at `stamp_ns`."""
        return self._body.needs(stamp_ns, cycle)

    def context(self, percepts: Percepts, moved_ns: int, cycle: int, version: int) -> CycleContext:
        """Gather all that was sensed for the view of `percepts`, since the self node was moved
        last; its scan is taken now.
        """
        motions = self.motions(percepts.stamp_ns, moved_ns)
        scan = self._scans.take(percepts.stamp_ns)
        return CycleContext(cycle, percepts, motions, version, scan, moved_ns)

    def discard(self, moved_ns: int) -> None:
        """Discard what has moved the self node."""
        self._motions.discard(moved_ns)
