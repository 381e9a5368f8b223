"""One real-time drive of the demo's loop, recorded, every module a process of its own."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import msgspec
from rich.console import Console

from bus.errors import CogmapError
from bus.runner import Stop
from bus.session import free_endpoint
from cli.run import display, summary
from cli.run.display import Display
from cli.run.drive import INTERRUPTED, Drive
from cli.run.figures import Figures
from cli.run.observer import Errors, Observer
from cli.run.plan import LOG_NAME, Choices, effective, everybody
from cli.run.watch import Watch
from logs.format import SUMMARY
from logs.reader import LogReader
from logs.recorder import Summary

PATIENCE_S = 180.0


class Course(Stop):
    """Asked to end after `seconds` of driving, too; it learns of them as a display, and shows them on another."""

    def __init__(self, shown_on: Display, seconds: float) -> None:
        super().__init__()
        self._shown_on, self._seconds, self._elapsed_s = shown_on, seconds, 0.0

    @property
    def asked(self) -> bool:
        """Whether to end."""
        return super().asked or self._elapsed_s >= self._seconds

    @property
    def interrupted(self) -> bool:
        """Whether a signal came."""
        return super().asked

    def say(self, sentence: str) -> None:
        """Show a sentence that stays."""
        self._shown_on.say(sentence)

    def waiting(self, names: list[str]) -> None:
        """Show whom the drive waits for."""
        self._shown_on.waiting(names)

    def driving(self, observer: Observer, errors: Errors) -> None:
        """Show how far it has come."""
        self._elapsed_s = observer.elapsed_s
        self._shown_on.driving(observer, errors)

    def close(self) -> None:
        """Leave the screen as it should stay."""
        self._shown_on.close()


def drive(folder: Path, laps: float = 1.0, seconds: float = PATIENCE_S) -> tuple[Figures, Watch]:
    """Drive `laps`, at most `seconds`, leaving the files of `cogmap run` in `folder`. Ctrl-C ends the benchmark."""
    began_s, choices = time.monotonic(), Choices(laps=laps)
    sections = effective({}, choices, everybody(choices, observer=True))
    course = Course(display.on(Console(stderr=True)), seconds)
    run = Drive(folder, free_endpoint(), "agent", choices, sections, began_s)
    try:
        watch = run.run(began_s + PATIENCE_S, course, course)
    finally:
        course.close()
    if run.ended_by == INTERRUPTED and course.interrupted:
        sys.exit(130)
    figures = summary.finish(run, watch)
    if not figures.commands:
        raise CogmapError("the drive gave no motor command: `cogmap doctor` says what is wrong")
    return figures, watch


def recording(folder: Path) -> Summary:
    """What the recorder said of the drive in `folder`. Raises CogmapError where it did not come to its end."""
    about = LogReader(folder / LOG_NAME).about(SUMMARY)
    if not about:
        raise CogmapError("the recorder was killed before it had finished: run the benchmark on an idle machine")
    return msgspec.json.decode(about["json"], type=Summary)
