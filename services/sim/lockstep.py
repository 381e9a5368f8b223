"""Simulated time in lockstep: it advances by one frame for each motor command. Pure."""

from __future__ import annotations

from typing import Protocol

from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import MotorCommand, TruePose, TrueTown

REPEAT_CHECK_NS = 1_000_000_000


class SteppedSim(Protocol):
    """A simulation that advances tick by tick, `ticks_per_frame` of them between two frames."""

    ticks_per_frame: int
    now_ns: int
    progress: float

    def drive(self, command: MotorCommand) -> None:
        """Obey a motor command from now on."""

    def step(self) -> list[Message]:
        """Advance by one tick; what is measured meanwhile."""

    def view(self) -> list[Message]:
        """The next frame."""

    def clock(self, rate: float) -> Clock:
        """The simulated time."""

    def truth(self) -> TruePose:
        """The robot's true pose."""

    def town(self) -> TrueTown:
        """The place that is simulated."""

    def changed_town(self) -> TrueTown | None:
        """The place, where it has changed since the last call."""


class Lockstep:
    """Advances `simulation` by one frame for each command that answers the last one, until the
    drive is over.
    """

    def __init__(self, simulation: SteppedSim, repeat_after_s: float) -> None:
        self._simulation = simulation
        self._repeat_after_ns = round(repeat_after_s * 1e9)

        self._frame_ns: int | None = None
        self._senses: list[Message] = []
        self._timed_frame_ns: int | None = None
        self._waiting_since_ns = 0

    def on_start(self) -> list[Message]:
        """The town, and the first frame."""
        return [self._simulation.town(), *self._advance()]

    def on_command(self, command: MotorCommand) -> list[Message] | None:
        """The next frame, after the odometry up to it; None where `command` answers another frame
        than the last, or the last once more.
        """
        if command.stamp_ns != self._frame_ns or self._simulation.progress >= 1.0:
            return None

        self._simulation.drive(command)

        return self._advance()

    def on_timer(self, wall_ns: int) -> list[Message]:
        """The last frame and its odometry once more, where no command has answered it for
        `repeat_after_s` of wall time: a module that was killed may have lost it.
        """
        if self._frame_ns is None or self._simulation.progress >= 1.0:
            return []

        if self._timed_frame_ns != self._frame_ns:
            self._timed_frame_ns = self._frame_ns
            self._waiting_since_ns = wall_ns

        if wall_ns - self._waiting_since_ns < self._repeat_after_ns:
            return []

        self._waiting_since_ns = wall_ns

        return self._senses

    def _advance(self) -> list[Message]:
        simulation = self._simulation
        odometry: list[Message] = []
        for _ in range(simulation.ticks_per_frame):
            odometry += simulation.step()

        clock = simulation.clock(0.0)
        truth = simulation.truth()
        changed = simulation.changed_town()
        town = [] if changed is None else [changed]
        view = simulation.view()

        self._frame_ns = simulation.now_ns
        self._senses = [*odometry, *view]

        return [*odometry, clock, truth, *town, *view]
