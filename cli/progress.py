"""How far work is, and how long it will take: for what takes a while."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import click
from rich.console import Console
from rich.progress import Progress, TimeElapsedColumn

from cogmap.recording.storage import reader

SHOWN_AFTER_S = 2.0
LINE_EVERY_S = 10.0
"""Of a log: often enough to see that it goes on."""

REMEMBERED_S = 3600.0
"""A terminal's estimate of the time left looks back so long: steps may take minutes."""


class Pace:
    """How far the work called `name` is. Work whose share falls back begins another round. Pure."""

    def __init__(self, name: str, now_s: float) -> None:
        self._name = name
        self._began_s = now_s
        self._round = 1
        self._round_began_s = now_s
        self._reached_s = now_s
        self.share = 0.0

    @property
    def label(self) -> str:
        """Return the name, with the number of the round from the second on."""
        return self._name if self._round == 1 else f"{self._name}, round {self._round}"

    def reach(self, share: float, now_s: float) -> bool:
        """Learn that so large a share is done. Returns whether that begins another round."""
        begins = share < self.share
        if begins:
            self._round += 1
            self._round_began_s = now_s
        if share != self.share:
            self._reached_s = now_s
        self.share = share
        return begins

    def line(self, now_s: float) -> str:
        """Say how far it is, and how long it takes: so far if nothing of it is known to be done.

        The time left is judged by the last step that was done, and runs down until the next one.
        """
        if self.share <= 0:
            return f"{self.label}: {duration(now_s - self._began_s)} so far"
        passed_s = self._reached_s - self._round_began_s
        left_s = passed_s * (1 - min(self.share, 1.0)) / self.share - (now_s - self._reached_s)
        if left_s <= 0:
            return f"{self.label}: {self.share:.0%}, {duration(now_s - self._began_s)} so far"
        return f"{self.label}: {self.share:.0%}, {duration(left_s)} left"


def duration(seconds: float) -> str:
    """Write a duration in seconds, or in minutes from two on."""
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"


@contextmanager
def bar(label: str) -> Iterator[reader.Progress]:
    """Yield a function of the share done. What takes longer than SHOWN_AFTER_S has a bar on a
    terminal; elsewhere there is a line on standard error every LINE_EVERY_S.
    """
    shown = _on_terminal(label) if sys.stderr.isatty() else _in_lines(label)
    with shown as show:
        yield show


@contextmanager
def _on_terminal(label: str) -> Iterator[reader.Progress]:
    columns = (*Progress.get_default_columns(), TimeElapsedColumn())
    console = Console(stderr=True)
    progress = Progress(
        *columns, console=console, transient=True, speed_estimate_period=REMEMBERED_S
    )
    task = progress.add_task(label, total=1.0)
    pace = Pace(label, time.monotonic())
    start = threading.Timer(SHOWN_AFTER_S, progress.start)
    start.daemon = True
    start.start()

    def show(share: float) -> None:
        if pace.reach(share, time.monotonic()):
            progress.reset(task, description=pace.label)
        progress.update(task, completed=share)

    try:
        yield show
    finally:
        start.cancel()
        start.join()
        progress.stop()


@contextmanager
def _in_lines(label: str) -> Iterator[reader.Progress]:
    pace = Pace(label, time.monotonic())
    has_ended = threading.Event()

    def tell() -> None:
        while not has_ended.wait(LINE_EVERY_S):
            click.echo(pace.line(time.monotonic()), err=True)

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()

    def show(share: float) -> None:
        pace.reach(share, time.monotonic())

    try:
        yield show
    finally:
        has_ended.set()
        teller.join()
