"""A recording in lockstep: it moves on by one view for each motor command. Pure."""

from __future__ import annotations

from cogmap.runtime.pausing import Pausing
from cogmap.runtime.repetition import Repetition
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock, Pause, Presence
from cogmap.schemas.sensing import MotorCommand
from cogmap.services.player.playhead import Playhead


class Lockstep:
    """Plays the next view for each command that answers the last one, until the recording is over.
    While time stands, the next view waits though the last one is answered.

    What a command says moves nothing.
    """

    def __init__(self, playhead: Playhead) -> None:
        self._playhead = playhead
        self._pausing = Pausing()
        self._is_answered = False
        self._view_ns: int | None = None
        self._sensed: list[Message] = []
        self._repetition = Repetition()

    def on_start(self) -> list[Message]:
        """Return what really stood there, if that is known, and the first view."""
        if self._playhead.is_resumed:
            self._repetition.doubt()
        return [*self._playhead.town(), *self._advance()]

    def on_command(self, command: MotorCommand) -> list[Message] | None:
        """Return the next view, after what was sensed up to it, or the end; None if `command`
        answers another view than the last, or the last once more.
        """
        if command.stamp_ns != self._view_ns or self._playhead.is_over:
            return None
        if self._is_answered:
            return None

        self._is_answered = True
        self._repetition.on_answer()
        return self._next()

    def on_pause(self, pause: Pause) -> list[Message]:
        """Return whether time stands now, and the next view, or the end, if it waited."""
        self._pausing.on_pause(pause)
        return [self._pausing.said(self._view_ns or 0), *self._next()]

    def on_presence(self, presence: Presence) -> None:
        """Note who leaves, and who comes back and may have lost what was sensed."""
        self._repetition.on_presence(presence)

    def on_timer(self, wall_ns: int) -> list[Message]:
        """Return what was sensed last once more if no command has answered it for longer than
        cycles take: a module that was killed may have lost it.
        """
        if self._view_ns is None or self._playhead.is_over:
            return []
        if self._is_answered:
            return list(self._pausing.said_again(self._view_ns, wall_ns))

        is_due = self._repetition.is_due(self._view_ns, wall_ns)
        return self._sensed if is_due else []

    def _next(self) -> list[Message]:
        """Return what comes next, if the last view is answered and time does not stand."""
        if not self._is_answered or self._playhead.is_over or not self._pausing.takes_step():
            return []
        return self._advance()

    def _advance(self) -> list[Message]:
        """Return what is sensed up to the next view, or, where there is none, the end."""
        step = self._playhead.advance()
        if step is None:
            return [self._playhead.end()]

        self._view_ns = step.stamp_ns
        self._is_answered = False
        clock = Clock(stamp_ns=step.stamp_ns, rate=0.0)
        self._sensed = [*step.before, clock, *step.view]
        return [*step.before, clock, *step.truth, *step.view]
