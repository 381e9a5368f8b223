"""A recording in real time, or some times as fast: it follows the wall's. Pure."""

from __future__ import annotations

from collections import deque

from msgspec.structs import replace

from cogmap.runtime.pausing import Pausing
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock, Pause, Playback
from cogmap.schemas.sensing import MotorCommand
from cogmap.services.player.playhead import Playhead

# How often what is due is looked for: half of the time between two rows of the simulation's wheels.
PERIOD_NS = 25_000_000
# At most so much of the wall's time is caught up at once.
CATCH_UP_NS = 250_000_000
# How often what stood there is published, for those who join later, and how much has been played,
# by which observers know in a long gap between two views that time passes.
TOLD_PERIOD_NS = 5_000_000_000

LAST_ANSWER_NS = 3_000_000_000
"""Wall time that the last view has for its command: some cycles of a loaded machine."""


class RealTime:
    """Plays what is due by the wall's time, of which `speed` times as much passes in the recording.

    If more than CATCH_UP_NS would have to be caught up, it falls behind instead. What a command
    says moves nothing.
    """

    def __init__(self, playhead: Playhead, speed: float) -> None:
        self._playhead = playhead
        self._speed = speed
        self._pausing = Pausing()
        self._is_started = False
        self._wall_ns: int | None = None
        self._now_ns = 0
        self._due: deque[Message] = deque()
        self._view_ns = -1
        self._answered_ns = -1
        self._waits_ns = 0
        self._told_ns: int | None = None
        self._played: Playback | None = None

    def on_start(self) -> None:
        """Let time begin with the next timer."""
        self._is_started = True

    def on_command(self, command: MotorCommand) -> None:
        """Note that a view was answered."""
        self._answered_ns = command.stamp_ns

    def on_pause(self, pause: Pause) -> list[Message]:
        """Return whether time stands now."""
        self._pausing.on_pause(pause)
        return [self._pausing.said(self._now_ns)]

    def on_timer(self, wall_ns: int) -> list[Message]:
        """Return all that is due at `wall_ns`, which is monotonic, and the end, once the last view
        is answered or has been waiting for LAST_ANSWER_NS. While time stands, that is nothing, or
        what is due up to the next view if that is to come.
        """
        if not self._is_started or self._playhead.is_over:
            return []

        passed_ns = 0
        if self._wall_ns is None:
            self._now_ns = self._playhead.begins_ns
        elif not self._pausing.is_paused:
            passed_ns = min(wall_ns - self._wall_ns, CATCH_UP_NS)
        self._wall_ns = wall_ns
        self._now_ns += round(passed_ns * self._speed)
        if self._pausing.is_paused:
            if not self._pausing.takes_step():
                return list(self._pausing.said_again(self._now_ns, wall_ns))
            if self._due or self._has_read_more():
                self._now_ns = max(self._now_ns, self._view_ns)

        messages: list[Message] = [Clock(stamp_ns=self._now_ns, rate=self._speed)]
        messages += self._told(wall_ns)
        messages += self._released()
        if self._due:
            return messages

        self._waits_ns += passed_ns
        if self._answered_ns >= self._view_ns or self._waits_ns >= LAST_ANSWER_NS:
            messages.append(self._playhead.end())
        return messages

    def _told(self, wall_ns: int) -> list[Message]:
        """Return what observers are told from time to time, if it is time."""
        if self._told_ns is not None and wall_ns - self._told_ns < TOLD_PERIOD_NS:
            return []

        self._told_ns = wall_ns
        told = self._playhead.town()
        if self._played is not None:
            told.append(replace(self._played, stamp_ns=self._now_ns, reasons=[]))
        return told

    def _released(self) -> list[Message]:
        """Take what is due now; if nothing comes later, nothing is left."""
        released: list[Message] = []
        while self._due or self._has_read_more():
            if self._due[0].stamp_ns > self._now_ns:
                break
            message = self._due.popleft()
            if isinstance(message, Playback):
                self._played = message
            released.append(message)
        return released

    def _has_read_more(self) -> bool:
        """Read what comes next, if there is more."""
        step = self._playhead.advance()
        if step is None:
            return False

        self._view_ns = step.stamp_ns
        self._due.extend([*step.before, *step.truth, *step.view])
        return True
