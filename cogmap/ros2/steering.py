"""Motor commands as speeds of a robot, which do not hold longer than they are known to be right.
Pure.
"""

from __future__ import annotations

from typing import NamedTuple

from cogmap.errors import MessageError
from cogmap.recording.exporting.ros_drive import speeds_of
from cogmap.schemas.sensing import MotorCommand

PERIOD_NS = 100_000_000
"""How often the speeds are said again: drivers of bases stop where they hear nothing for some
tenths of a second.
"""

MAX_AGE_NS = 2_500_000_000
"""Age of the view that a command answers beyond which it is refused, as the simulation does."""


class Limits(NamedTuple):
    """The greatest speed and turn rate that are asked for, and how long a command holds."""

    speed_m_s: float
    turn_rate_rad_s: float
    hold_s: float


class Speeds(NamedTuple):
    """What a robot is asked for: speed ahead, and turn rate to the left."""

    speed_m_s: float = 0.0
    turn_rate_rad_s: float = 0.0


class Steering:
    """Follows the motor commands: `speeds` are those to ask for, None before the first command."""

    def __init__(self, limits: Limits) -> None:
        self.stops = 0
        self.speeds: Speeds | None = None
        self._limits = limits
        self._stamp_ns = 0
        self._arrived_ns = 0

    def on_command(self, command: MotorCommand, now_ns: int, wall_ns: int) -> None:
        """Obey a command that arrives at the run's time `now_ns`; one that arrives after a newer
        one is ignored. Raises MessageError if it answers a view that is too old.
        """
        age_ns = now_ns - command.stamp_ns
        if age_ns > MAX_AGE_NS:
            raise MessageError(
                f"motor command: it answers what was seen {age_ns / 1e9:.1f} s ago, and none older "
                f"than {MAX_AGE_NS / 1e9:g} s is passed on: lower --rate or use a faster machine"
            )
        if command.stamp_ns < self._stamp_ns:
            return

        self._stamp_ns = command.stamp_ns
        self._arrived_ns = wall_ns
        self.speeds = _limited(Speeds(*speeds_of(command)), self._limits)

    def halt(self) -> None:
        """Ask for no motion."""
        self.speeds = Speeds()

    def on_timer(self, wall_ns: int) -> None:
        """Stop the robot if the last command has held as long as it may."""
        if self.speeds in {None, Speeds()}:
            return
        if wall_ns - self._arrived_ns > self._limits.hold_s * 1e9:
            self.speeds = Speeds()
            self.stops += 1


def _limited(asked: Speeds, limits: Limits) -> Speeds:
    """Return speeds within the limits that lead along the same arc."""
    share = 1.0
    for value, limit in zip(asked, (limits.speed_m_s, limits.turn_rate_rad_s), strict=True):
        if abs(value) > limit:
            share = min(share, limit / abs(value))
    return Speeds(asked.speed_m_s * share, asked.turn_rate_rad_s * share)
