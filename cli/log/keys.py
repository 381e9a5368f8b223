"""Keys pause a replay, and step through it, where there is a terminal."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import sys
import termios
import tty
from collections.abc import Iterator

import click

from cogmap.runtime.process import Stop

PAUSED = "paused: space continues, s goes on by a view"


class Keys:
    """Waits for time to pass, for a signal, and, on a terminal, for keys: the space bar pauses and
    continues, `s` goes on by a view.
    """

    def __init__(self, stop: Stop, paused: bool) -> None:
        self._stop = stop
        self.paused = paused
        self._steps = 0
        self._wakes: list[socket.socket] = []

    @property
    def asked(self) -> bool:
        """Return whether to end."""
        return self._stop.asked

    @contextlib.contextmanager
    def listening(self) -> Iterator[Keys]:
        """Read single keys from the terminal until left; none if standard input is no terminal.

        Raises UsageError if it is to begin paused and there is no terminal.
        """
        if not sys.stdin.isatty():
            if self.paused:
                raise click.UsageError(
                    "--start-paused needs a terminal: the space bar continues there"
                )
            yield self
            return

        terminal = sys.stdin.fileno()
        before = termios.tcgetattr(terminal)
        self._wakes = list(socket.socketpair())
        self._wakes[1].setblocking(False)
        signal.set_wakeup_fd(self._wakes[1].fileno())
        tty.setcbreak(terminal)

        try:
            yield self
        finally:
            termios.tcsetattr(terminal, termios.TCSADRAIN, before)
            signal.set_wakeup_fd(-1)
            for end in self._wakes:
                end.close()

    def take_step(self) -> bool:
        """Return whether it is asked to go on for a view; each wish once."""
        if not self._steps:
            return False
        self._steps -= 1
        return True

    def wait(self, timeout_s: float) -> bool:
        """Wait so long, or until asked to end, to pause or to continue. Returns whether to end."""
        if not self._wakes:
            return self._stop.wait(timeout_s)

        terminal = sys.stdin.fileno()
        ready, _, _ = select.select([terminal, self._wakes[0]], [], [], timeout_s)
        if terminal in ready:
            self._press(os.read(terminal, 64))
        return self._stop.asked

    def _press(self, keys: bytes) -> None:
        """Do what keys mean: a step pauses too."""
        steps = keys.count(b"s")
        if b" " in keys or (steps and not self.paused):
            self.paused = not self.paused
            click.echo(PAUSED if self.paused else "continuing", err=True)
        self._steps += steps
