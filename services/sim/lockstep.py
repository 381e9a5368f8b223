"""Simulated time in lockstep: it advances by one frame for each motor command. Pure."""

from __future__ import annotations

from cogmap.runtime.pausing import Pausing
from cogmap.runtime.repetition import Repetition
from cogmap.schemas.base import Message
from cogmap.schemas.process import Pause, Presence
from cogmap.schemas.sensing import MotorCommand
from cogmap.services.sim.simulation import Simulation


class Lockstep:
    """Advances `simulation` by one frame for each command that answers the last one, until the
    drive is over. While time stands, the next frame waits though the last one is answered.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._pausing = Pausing()
        self._is_answered = False
        self._frame_ns: int | None = None
        self._senses: list[Message] = []
        self._repetition = Repetition()

    def on_start(self) -> list[Message]:
        """Return the town, and the first frame."""
        if self._simulation.is_resumed:
            self._repetition.doubt()
        return [self._simulation.town(), *self._advance()]

    def on_command(self, command: MotorCommand) -> list[Message] | None:
        """Return the next frame, after the odometry up to it; None if `command` answers another
        frame than the last, or the last once more.
        """
        if command.stamp_ns != self._frame_ns or self._simulation.progress >= 1.0:
            return None
        if self._is_answered:
            return None

        self._simulation.drive(command)
        self._is_answered = True
        self._repetition.on_answer()
        return self._next()

    def on_pause(self, pause: Pause) -> list[Message]:
        """Return whether time stands now, and the next frame if it waited."""
        self._pausing.on_pause(pause)
        return [self._pausing.said(self._simulation.now_ns), *self._next()]

    def on_presence(self, presence: Presence) -> None:
        """Note who leaves, and who comes back and may have lost what was sensed."""
        self._repetition.on_presence(presence)

    def on_timer(self, wall_ns: int) -> list[Message]:
        """Return the last frame, its odometry and clock once more if no command has answered it for
        longer than cycles take: a module that was killed may have lost it.
        """
        if self._frame_ns is None or self._simulation.progress >= 1.0:
            return []
        if self._is_answered:
            return list(self._pausing.said_again(self._simulation.now_ns, wall_ns))

        is_due = self._repetition.is_due(self._frame_ns, wall_ns)
        return self._senses if is_due else []

    def _next(self) -> list[Message]:
        """Return the next frame, if the last one is answered and time does not stand."""
        if not self._is_answered or not self._pausing.takes_step():
            return []
        return self._advance()

    def _advance(self) -> list[Message]:
        simulation = self._simulation
        odometry: list[Message] = []
        for _ in range(simulation.ticks_per_frame):
            odometry += simulation.step()

        clock = simulation.clock(0.0)
        truth = simulation.truth()
        town = simulation.changed_town()
        view = simulation.view()

        self._frame_ns = simulation.now_ns
        self._is_answered = False
        # The clock, too: whoever drives in motor's place may answer that.
        self._senses = [*odometry, clock, *view]

        return [*odometry, clock, truth, *town, *view]
