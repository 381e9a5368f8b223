"""Shows how a run goes: a live line on a terminal, a plain one now and then elsewhere."""

from __future__ import annotations

import time
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from cli.launch.observer import Errors, Observer

PLAIN_PERIOD_S = 5.0


class Display(Protocol):
    """Where a run is shown."""

    def say(self, sentence: str) -> None:
        """Show a sentence that stays."""

    def waiting(self, names: list[str]) -> None:
        """Show whom the drive waits for."""

    def driving(self, observer: Observer, errors: Errors) -> None:
        """Show how far it has come, and the errors now."""

    def close(self) -> None:
        """Leave the screen as it should stay."""


def _drive_line(observer: Observer, errors: Errors) -> str:
    estimate_m, integration_m = (
        (each[-1] if each.size else 0.0) for each in (errors.estimate_m, errors.integration_m)
    )
    return (
        f"{observer.elapsed_s:5.1f} s  {observer.travelled_m:6.1f} m  "
        f"{estimate_m:.2f} m off, path integration alone {integration_m:.2f} m"
    )


class LiveDisplay:
    """A bar and a line that change in place."""

    def __init__(self, console: Console) -> None:
        self._progress = Progress(
            BarColumn(bar_width=None),
            TaskProgressColumn(),
            TextColumn("{task.description}"),
            console=console,
            expand=True,
        )
        self._task = self._progress.add_task("starting", total=1.0)
        self._progress.start()

    def say(self, sentence: str) -> None:
        self._progress.console.print(sentence, highlight=False)

    def waiting(self, names: list[str]) -> None:
        self._progress.update(
            self._task, description=f"waiting for {', '.join(names)}" if names else "starting"
        )

    def driving(self, observer: Observer, errors: Errors) -> None:
        line = _drive_line(observer, errors)
        self._progress.update(self._task, completed=observer.progress, description=line)

    def close(self) -> None:
        self._progress.stop()


class PlainDisplay:
    """Lines for a file or a pipe."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._next_s = 0.0

    def say(self, sentence: str) -> None:
        self._console.print(sentence, highlight=False, soft_wrap=True)

    def waiting(self, names: list[str]) -> None:
        if names:
            self._now_and_then(f"waiting for {', '.join(names)}")

    def driving(self, observer: Observer, errors: Errors) -> None:
        self._now_and_then(f"{observer.progress:4.0%}  {_drive_line(observer, errors)}")

    def _now_and_then(self, line: str) -> None:
        if time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + PLAIN_PERIOD_S
            self.say(line)

    def close(self) -> None:
        """Nothing to leave."""


def on(console: Console) -> Display:
    """The display that suits `console`."""
    return LiveDisplay(console) if console.is_terminal else PlainDisplay(console)
