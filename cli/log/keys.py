"""Keys pause a replay or a recording, and step through it, where there is a terminal."""

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
from types import FrameType
from typing import Self

import click

from cogmap.runtime.process import Stop


class Keys:
    """Waits for time to pass, for a signal, and, on a terminal, for keys: the space bar pauses and
    continues.
    """

    told_paused = "paused: space continues"

    def __init__(self, stop: Stop, paused: bool) -> None:
        self._stop = stop
        self.paused = paused
        self._wakes: list[socket.socket] = []

    @property
    def asked(self) -> bool:
        """Return whether to end."""
        return self._stop.asked

    @contextlib.contextmanager
    def listening(self) -> Iterator[Self]:
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

    def wait(self, timeout_s: float) -> bool:
        """Wait so long, or until asked to end, to pause or to continue. Returns whether to end."""
        if not self._wakes:
            return self._stop.wait(timeout_s)

        terminal = sys.stdin.fileno()
        ready, _, _ = select.select([terminal, self._wakes[0]], [], [], timeout_s)
        if terminal in ready:
            self.press(os.read(terminal, 64))
        return self._stop.asked

    def press(self, keys: bytes) -> None:
        """Do what keys mean."""
        if b" " in keys:
            self.toggle()

    def toggle(self) -> None:
        """Pause, or continue, and say so."""
        self.paused = not self.paused
        click.echo(self.told_paused if self.paused else "continuing", err=True)


class ReplayKeys(Keys):
    """Goes on by a view at `s`, too, and pauses there."""

    told_paused = "paused: space continues, s goes on by a view"

    def __init__(self, stop: Stop, paused: bool) -> None:
        super().__init__(stop, paused)
        self._steps = 0

    def take_step(self) -> bool:
        """Return whether it is asked to go on for a view; each wish once."""
        if not self._steps:
            return False
        self._steps -= 1
        return True

    def press(self, keys: bytes) -> None:
        """Do what keys mean."""
        steps = keys.count(b"s")
        if b" " in keys or (steps and not self.paused):
            self.toggle()
        self._steps += steps


class RecordKeys(Keys):
    """Takes a snapshot at `s`, too, and at the signal USR1, for a recorder without a terminal."""

    def __init__(self, stop: Stop, paused: bool) -> None:
        super().__init__(stop, paused)
        self._wants_snapshot = False

    @contextlib.contextmanager
    def signalled(self) -> Iterator[None]:
        """Take a snapshot at each USR1 until left."""
        before = signal.signal(signal.SIGUSR1, self._on_signal)
        try:
            yield
        finally:
            signal.signal(signal.SIGUSR1, before)

    def take_snapshot(self) -> bool:
        """Return whether a snapshot is asked for; each wish once."""
        wanted = self._wants_snapshot
        self._wants_snapshot = False
        return wanted

    def press(self, keys: bytes) -> None:
        """Do what keys mean."""
        super().press(keys)
        self._wants_snapshot |= b"s" in keys

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self._wants_snapshot = True
