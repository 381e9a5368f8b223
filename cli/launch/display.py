"""Shows how a run proceeds: a line that changes on a terminal, elsewhere one every few seconds."""

from __future__ import annotations

import time
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from cogmap.cli.launch.observer import Observer
from cogmap.evaluation.paths import Errors

PLAIN_PERIOD_S = 5.0


class Display(Protocol):
    """Where a run is shown."""

    def show(self, sentence: str) -> None:
        """Show a sentence that stays."""

    def waiting(self, names: list[str]) -> None:
        """Show which modules the drive waits for."""

    def driving(self, observer: Observer, errors: Errors) -> None:
        """Show how far the robot has come, and the errors now."""

    def close(self) -> None:
        """Leave the screen as it should stay."""


def _drive_line(observer: Observer, errors: Errors) -> str:
    """Write time and distance so far, and the errors at the last estimate; 0 before the first, none
    if nobody knows the true path.
    """
    driven = f"{observer.elapsed_s:5.1f} s  {observer.travelled_m:6.1f} m"
    if observer.start is None:
        return driven

    estimate_m, fused_m, wheels_m = (
        float(errors_m[-1]) if errors_m.size else 0.0
        for errors_m in (errors.estimate_m, errors.fused_m, errors.wheels_m)
    )
    alone = f"path integration alone: fused {fused_m:.2f} m"
    if errors.wheels_m.size:
        alone = f"{alone}, wheels {wheels_m:.2f} m"
    return f"{driven}  position error {estimate_m:.2f} m; {alone}"


def _waiting_line(names: list[str]) -> str:
    return f"waiting for {', '.join(names)}" if names else "starting"


class Furthest:
    """The largest share of a drive that was done: goals that are given late add to what is left,
    and a new route may be longer, which is no step back.
    """

    def __init__(self) -> None:
        self._share = 0.0

    def share(self, observer: Observer) -> float:
        """Return it, with what is done by now."""
        self._share = max(self._share, observer.progress)
        return self._share


class LiveDisplay:
    """A progress bar and a line that change in place."""

    def __init__(self, console: Console) -> None:
        self._furthest = Furthest()
        self._progress = Progress(
            BarColumn(bar_width=None),
            TaskProgressColumn(),
            TextColumn("{task.description}"),
            console=console,
            expand=True,
        )
        self._task = self._progress.add_task("starting", total=1.0)
        self._progress.start()

    def show(self, sentence: str) -> None:
        self._progress.console.print(sentence, highlight=False)

    def waiting(self, names: list[str]) -> None:
        self._progress.update(self._task, description=_waiting_line(names))

    def driving(self, observer: Observer, errors: Errors) -> None:
        line = _drive_line(observer, errors)
        self._progress.update(
            self._task, completed=self._furthest.share(observer), description=line
        )

    def close(self) -> None:
        self._progress.stop()


class PlainDisplay:
    """Lines for a file or a pipe."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._furthest = Furthest()
        self._next_s = 0.0

    def show(self, sentence: str) -> None:
        self._console.print(sentence, highlight=False, soft_wrap=True)

    def waiting(self, names: list[str]) -> None:
        if names:
            self._show_periodically(_waiting_line(names))

    def driving(self, observer: Observer, errors: Errors) -> None:
        share = self._furthest.share(observer)
        self._show_periodically(f"{share:4.0%}  {_drive_line(observer, errors)}")

    def _show_periodically(self, line: str) -> None:
        now_s = time.monotonic()
        if now_s >= self._next_s:
            self._next_s = now_s + PLAIN_PERIOD_S
            self.show(line)

    def close(self) -> None:
        """Leave the lines as they are."""


def display_on(console: Console) -> Display:
    """Make the display that suits `console`."""
    return LiveDisplay(console) if console.is_terminal else PlainDisplay(console)
