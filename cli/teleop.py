"""`cogmap teleop`: drives the robot by keys, in the place of the module `motor`."""

from __future__ import annotations

import sys

import click

from cogmap.bus.discovery import Role
from cogmap.cli.options import FiniteRange
from cogmap.cli.topic.observing import inspect_system
from cogmap.errors import UsageError
from cogmap.robot import MAX_WHEEL_RAD_S, TRACK_M, WHEEL_RADIUS_M
from cogmap.runtime.client import Client
from cogmap.runtime.module import Module
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import MotorCommand

MOTOR = "motor"
MAX_SPEED_M_S = MAX_WHEEL_RAD_S * WHEEL_RADIUS_M
SPEED_M_S = 2.0
TURN_RATE_RAD_S = 0.6
LOOK_NS = 50_000_000

HELD_NS = 600_000_000
"""Time after which a key counts as released: a keyboard repeats a held key after half a second at
most.
"""

DIRECTIONS = {
    "u": (1, 1),
    "i": (1, 0),
    "o": (1, -1),
    "j": (0, 1),
    "k": (0, 0),
    "l": (0, -1),
    "m": (-1, -1),
    ",": (-1, 0),
    ".": (-1, 1),
    "\x1b[A": (1, 0),
    "\x1b[B": (-1, 0),
    "\x1b[D": (0, 1),
    "\x1b[C": (0, -1),
    " ": (0, 0),
}
"""What each key does: ahead or back, and to the left or right, as in ROS's teleop_twist_keyboard;
those with an escape are the arrows.
"""

ENDS = ("q", "\x03", "\x04")
_HELP = """\
  u  i  o      ahead, to the left or right
  j  k  l      turn, stop
  m  ,  .      back
  the arrows do too; the space bar stops, q ends it. The robot moves while a key is held."""


class Steering:
    """Follows the keys: `speed_m_s` and `turn_rate_rad_s` are those of a key that is held. Pure."""

    def __init__(
        self, speed_m_s: float = SPEED_M_S, turn_rate_rad_s: float = TURN_RATE_RAD_S
    ) -> None:
        self._speed_m_s = speed_m_s
        self._turn_rate_rad_s = turn_rate_rad_s
        self._direction = (0, 0)
        self._is_pressed = False
        self._pressed_ns = 0

    def press(self, key: str) -> None:
        """Go where `key` leads; one that leads nowhere is ignored."""
        if key in DIRECTIONS:
            self._direction = DIRECTIONS[key]
            self._is_pressed = True

    def on_timer(self, wall_ns: int) -> None:
        """Let the last key be released, if it was not pressed again for HELD_NS."""
        if self._is_pressed:
            self._is_pressed = False
            self._pressed_ns = wall_ns
        elif wall_ns - self._pressed_ns >= HELD_NS:
            self._direction = (0, 0)

    def on_clock(self, clock: Clock) -> MotorCommand:
        """Return the command for the key that is held."""
        ahead, left = self._direction
        speed_rad_s = ahead * self._speed_m_s / WHEEL_RADIUS_M
        turn_rad_s = left * self._turn_rate_rad_s * TRACK_M / 2 / WHEEL_RADIUS_M
        return MotorCommand(
            stamp_ns=clock.stamp_ns,
            left_wheel_rad_s=speed_rad_s - turn_rad_s,
            right_wheel_rad_s=speed_rad_s + turn_rad_s,
        )

    def module(self) -> Module:
        """Return the module that takes the place of `motor`."""
        module = Module(MOTOR, "teleop")
        module.on(topics.CLOCK, self.on_clock, [topics.MOTOR_COMMAND])
        return module.every(LOOK_NS, self.on_timer)


@click.command()
@click.option(
    "--speed",
    "speed_m_s",
    type=FiniteRange(min=0, min_open=True, max=MAX_SPEED_M_S),
    default=SPEED_M_S,
    show_default=True,
    help="Speed ahead and back, in m/s.",
)
@click.option(
    "--turn",
    "turn_rate_rad_s",
    type=FiniteRange(min=0, min_open=True, max=5.0),
    default=TURN_RATE_RAD_S,
    show_default=True,
    help="Turn rate, in rad/s.",
)
@connect_option
@agent_option
def teleop(speed_m_s: float, turn_rate_rad_s: float, connect: str, agent: str) -> None:
    """Drive the robot by the keys of a terminal, in the place of the module motor.

    Start the others by `cogmap run --without motor`. The mind goes on: it maps what you drive past.
    """
    if not sys.stdin.isatty():
        raise UsageError("teleop reads keys from a terminal: start it in one")

    check_nobody_drives(connect, agent)
    steering = Steering(speed_m_s, turn_rate_rad_s)
    click.echo(_HELP)
    with Client(steering.module(), connect, agent):
        while (key := _key()) not in ENDS:
            steering.press(key)


def check_nobody_drives(connect: str, agent: str) -> None:
    """Raise UsageError if a process commands the robot's wheels already."""
    publishing = inspect_system(connect, agent).doing(Role.PUBLISHES, topics.MOTOR_COMMAND)
    if publishing:
        names = ", ".join(process.name for process in publishing)
        raise UsageError(
            f"{names} drives the robot already: start with `cogmap run --without motor`"
        )


def _key() -> str:
    """Wait for a key. Ctrl-C and the end of the input are keys that end it."""
    try:
        return click.getchar()
    except (KeyboardInterrupt, EOFError):
        return ENDS[0]
