"""One real-time drive of the demo's loop, recorded, every module a process of its own."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import msgspec
from rich.console import Console

from cli.launch.drive import INTERRUPTED, Drive
from cli.launch.metrics import Figures
from cli.launch.observer import Errors, Observer
from cli.launch.plan import LOG_NAME, Choices, effective, everybody
from cli.launch.watch import Watch
from cli.run import display, summary
from cli.run.display import Display
from cogmap.bus.session import free_endpoint
from cogmap.errors import CogmapError
from cogmap.recording.recorder import Summary
from cogmap.recording.storage.format import SUMMARY
from cogmap.recording.storage.reader import LogReader
from cogmap.runtime.process import Stop

PATIENCE_S = 180.0


class Course(Stop):
    """Asked to end after `seconds` of driving, too; it learns of them as a display, and shows them
    on another.
    """

    def __init__(self, shown_on: Display, seconds: float) -> None:
        super().__init__()
        self._shown_on = shown_on
        self._seconds = seconds
        self._elapsed_s = 0.0

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
    """Drive `laps`, at most `seconds`, leaving the files of `cogmap run` in `folder`. Ctrl-C ends
    the benchmark.
    """
    began_s = time.monotonic()
    choices = Choices(laps=laps)
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
    """What the recorder said of the drive in `folder`. Raises CogmapError where it did not come to
    its end.
    """
    about = LogReader(folder / LOG_NAME).about(SUMMARY)
    if not about:
        raise CogmapError(
            "the recorder was killed before it had finished: run the benchmark on an idle machine"
        )
    return msgspec.json.decode(about["json"], type=Summary)
