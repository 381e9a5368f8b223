"""The time of a log that is played: when a message is due, and the clock that is published."""

from __future__ import annotations

import time
from typing import Protocol

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Bus
from cogmap.schemas import topics
from cogmap.schemas.process import Clock

# How long one wait lasts; it ends earlier if the pause does.
_PAUSE_S = 60.0


class Control(Protocol):
    """Whoever may stop or pause a player."""

    @property
    def asked(self) -> bool:
        """Return whether it is asked to end."""

    @property
    def paused(self) -> bool:
        """Return whether it is asked to stand still."""

    def take_step(self) -> bool:
        """Return whether it is asked to go on for a view although it is paused; each wish once."""

    def wait(self, timeout_s: float) -> bool:
        """Wait so long, or until asked to end, to pause or to continue. Returns whether to end."""


class ClockPublisher:
    """Publishes the newest stamp that was played as the clock, `clock_hz` times a second."""

    def __init__(self, bus: Bus, source: str, rate: float, clock_hz: float) -> None:
        bus.declare(topics.CLOCK)
        self.period_ns = int(1e9 / clock_hz)
        self._bus = bus
        self._source = source
        self._rate = rate
        self._incarnation = time.time_ns()
        self._seq = 0
        self._stamp_ns = 0

    def see(self, stamp_ns: int) -> None:
        """Note the stamp of a message that was played."""
        self._stamp_ns = max(self._stamp_ns, stamp_ns)

    def publish(self) -> None:
        """Publish the newest stamp."""
        clock = Clock(stamp_ns=self._stamp_ns, seq=self._seq, source=self._source, rate=self._rate)
        now_ns = time.time_ns()
        envelope = Envelope(self._source, self._seq, self._incarnation, now_ns, now_ns)
        self._bus.publish(topics.CLOCK, encode(clock), envelope)
        self._seq += 1


class Pacer:
    """Turns log time into waiting, `rate` times as fast. Time stands still while paused, but for
    a step, which lasts until `end_step`.

    `late_max_s` is the largest delay of a message.
    """

    def __init__(self, rate: float, control: Control) -> None:
        self.late_max_s = 0.0
        self._rate = rate
        self._control = control
        self._start_log_ns = 0
        self._start_ns = 0
        self._next_clock_ns = 0
        self._is_stepping = False

    def begin(self, log_time_ns: int) -> None:
        """Let `log_time_ns` be now."""
        self._start_log_ns = log_time_ns
        self._start_ns = time.monotonic_ns()
        self._next_clock_ns = 0

    def wait_until(self, log_time_ns: int, clock: ClockPublisher | None) -> bool:
        """Wait until it is `log_time_ns`; `clock` publishes meanwhile. Return False if asked to
        end.
        """
        due_ns = int((log_time_ns - self._start_log_ns) / self._rate)
        while not self._control.asked:
            now_ns = time.monotonic_ns() - self._start_ns
            if self._stands():
                # The pause is left out of the time.
                self._control.wait(_PAUSE_S)
                self._start_ns = time.monotonic_ns() - now_ns
                continue

            until_ns = due_ns
            if clock is not None:
                if now_ns >= self._next_clock_ns:
                    clock.publish()
                    self._next_clock_ns = max(self._next_clock_ns + clock.period_ns, now_ns)
                until_ns = min(due_ns, self._next_clock_ns)

            if now_ns >= due_ns:
                self.late_max_s = max(self.late_max_s, (now_ns - due_ns) / 1e9)
                return True
            self._control.wait(max(0, until_ns - now_ns) / 1e9)
        return False

    def end_step(self) -> None:
        """Let time stand again, if it is to be paused."""
        self._is_stepping = False

    def _stands(self) -> bool:
        """Decide whether time stands, and begin a step that is asked for."""
        if not self._control.paused:
            return False
        self._is_stepping = self._is_stepping or self._control.take_step()
        return not self._is_stepping
