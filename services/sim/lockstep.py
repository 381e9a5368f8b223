"""Simulated time in lockstep: it advances by one frame for each motor command. Pure."""

from __future__ import annotations

from cogmap.runtime.pausing import Pausing
from cogmap.schemas.base import Message
from cogmap.schemas.process import Pause
from cogmap.schemas.sensing import MotorCommand
from cogmap.services.sim.simulation import Simulation

# How often the wait for a command is looked at: a tenth of REPEAT_AFTER_NS.
REPEAT_CHECK_NS = 1_000_000_000

REPEAT_AFTER_NS = 10_000_000_000
"""Wall time without a motor command after which a frame is published again: no cycle of a loaded
machine takes as long, and a module that was restarted is back within it.
"""


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
        self._timed_frame_ns: int | None = None
        self._waiting_since_ns = 0

    def on_start(self) -> list[Message]:
        """Return the town, and the first frame."""
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
        return self._next()

    def on_pause(self, pause: Pause) -> list[Message]:
        """Return whether time stands now, and the next frame if it waited."""
        self._pausing.on_pause(pause)
        return [self._pausing.said(self._simulation.now_ns), *self._next()]

    def on_timer(self, wall_ns: int) -> list[Message]:
        """Return the last frame and its odometry once more if no command has answered it for
        REPEAT_AFTER_NS of wall time: a module that was killed may have lost it.
        """
        if self._frame_ns is None or self._simulation.progress >= 1.0:
            return []
        if self._is_answered:
            return list(self._pausing.said_again(self._simulation.now_ns, wall_ns))

        if self._timed_frame_ns != self._frame_ns:
            self._timed_frame_ns = self._frame_ns
            self._waiting_since_ns = wall_ns

        if wall_ns - self._waiting_since_ns < REPEAT_AFTER_NS:
            return []

        self._waiting_since_ns = wall_ns

        return self._senses

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
        self._senses = [*odometry, *view]

        return [*odometry, clock, truth, *town, *view]
