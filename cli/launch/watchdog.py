"""Detects that a drive cannot succeed: nothing happens, or the robot stays where it is. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from cogmap.cli.launch.outcome import Ending, Outcome
from cogmap.schemas.sensing import SpeedLimit

STALLED_S = 30.0
STUCK_S = 30.0
MIN_MOVE_M = 2.0
WAITS = (SpeedLimit.NO_ROUTE, SpeedLimit.AT_GOAL)
REMEDY = (
    "end other programs, close browsers that look at the dashboard, or use --lockstep, which waits "
    "for every answer"
)
MAX_SHARE_SLOWED = 0.3
"""Where more of the commands are limited by the age of their poses, the machine is too slow."""


@dataclass(frozen=True)
class Situation:
    """A drive at `now_s` of the monotonic clock: `drive_s` of its own time have passed, and the
    robot is at `place_m`, (x, y).

    `missing` are the modules that are not ready, `halted_by` is the reason of the newest of so many
    `commands`, NONE where it moves the wheels. `is_charging` is whether its battery is charged now,
    `is_out` whether that is empty. `is_recorded` is whether a recording is played, in which nothing
    moves the robot; `is_paused` whether somebody lets time stand.
    """

    now_s: float
    drive_s: float
    place_m: tuple[float, float]
    commands: int
    halted_by: SpeedLimit = SpeedLimit.NONE
    missing: Sequence[str] = ()
    is_charging: bool = False
    is_out: bool = False
    is_recorded: bool = False
    is_paused: bool = False


class Watchdog:
    """Compares each situation of a drive with the last in which something had happened."""

    def __init__(self) -> None:
        self._ticked: Situation | None = None
        self._moved: Situation | None = None

    def check(self, situation: Situation) -> Ending | None:
        """Decide how the drive must end, if it must.

        It is stalled after STALLED_S in which its time stood still, and stuck after STUCK_S of its
        own time in which the robot, though it has a route, stayed within MIN_MOVE_M of a place: one
        that backs away and returns gets nowhere. One that stays to be charged is not stuck, nor is
        one in a recording.
        """
        if situation.is_out:
            return Ending(Outcome.OUT_OF_ENERGY, "the robot's battery is empty: see map.png")

        ticked = self._ticked
        moved = self._moved
        if ticked is None or moved is None:
            self._ticked = situation
            self._moved = situation
            return None

        if situation.drive_s > ticked.drive_s or situation.is_paused:
            self._ticked = situation
        elif situation.now_s - ticked.now_s >= STALLED_S:
            return Ending(Outcome.STALLED, _stalled(situation))

        has_moved = math.dist(situation.place_m, moved.place_m) >= MIN_MOVE_M
        may_stay = situation.is_charging or situation.is_recorded
        has_reason = may_stay or situation.halted_by in WAITS
        if has_moved or has_reason:
            self._moved = situation
        elif situation.drive_s - moved.drive_s >= STUCK_S:
            return _stuck(situation, situation.commands - moved.commands)

        return None


def _stalled(situation: Situation) -> str:
    if situation.missing:
        names = ", ".join(situation.missing)
        return f"nothing happened for {STALLED_S:.0f} s: {names} is not ready, see its log"
    return (
        f"nothing happened for {STALLED_S:.0f} s, though every module is ready: "
        "`cogmap doctor` names the one that does not answer"
    )


def _stuck(situation: Situation, commands: int) -> Ending:
    still = f"the robot has not moved for {STUCK_S:.0f} s"
    if situation.missing:
        names = ", ".join(situation.missing)
        return Ending(Outcome.STALLED, f"{still}: {names} is not ready, see its log")
    if not commands:
        return Ending(Outcome.STALLED, f"{still}: no motor command arrived, see motor's log")
    if situation.halted_by is SpeedLimit.POSE_AGE:
        return Ending(
            Outcome.TOO_SLOW,
            f"{still}: its pose is too old to move safely, as this machine is too slow: {REMEDY}",
        )
    if situation.halted_by:
        return Ending(Outcome.STUCK, f"{still}, halted by {situation.halted_by.value}: see map.png")
    return Ending(Outcome.STUCK, f"{still}, though its wheels turn: see map.png")
