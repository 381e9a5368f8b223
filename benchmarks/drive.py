"""One real-time drive of the demo's loop, recorded, every module a process of its own."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import msgspec
from rich.console import Console

from cogmap.bus.session import free_endpoint
from cogmap.cli.launch.display import Display, display_on
from cogmap.cli.launch.drive import Drive
from cogmap.cli.launch.drive_metrics import RunMetrics
from cogmap.cli.launch.forking.client import fork_server
from cogmap.cli.launch.observer import Observer
from cogmap.cli.launch.outcome import Outcome
from cogmap.cli.launch.plan import Choices, effective
from cogmap.cli.launch.watch import Watch
from cogmap.cli.run import summary
from cogmap.errors import CogmapError
from cogmap.evaluation.paths import Errors
from cogmap.recording.recorder import Summary
from cogmap.recording.storage.format import LOG_NAME, SUMMARY
from cogmap.recording.storage.reader import LogReader
from cogmap.runtime.config import Sections
from cogmap.runtime.process import Stop

TIMEOUT_S = 180.0


class TimedStop(Stop):
    """A stop that is also asked for after `seconds` of driving.

    It learns of the driving as a display does, and passes everything on to `display`.
    """

    def __init__(self, display: Display, seconds: float) -> None:
        super().__init__()
        self._display = display
        self._seconds = seconds
        self._elapsed_s = 0.0

    @property
    def asked(self) -> bool:
        """Return whether to end."""
        is_over = self._elapsed_s >= self._seconds
        return is_over or super().asked

    @property
    def interrupted(self) -> bool:
        """Return whether a signal asked for the end."""
        return super().asked

    def show(self, sentence: str) -> None:
        """Show a sentence that stays."""
        self._display.show(sentence)

    def waiting(self, names: list[str]) -> None:
        """Show which modules the drive waits for."""
        self._display.waiting(names)

    def driving(self, observer: Observer, errors: Errors) -> None:
        """Show how far the drive is."""
        self._elapsed_s = observer.elapsed_s
        self._display.driving(observer, errors)

    def close(self) -> None:
        """Leave the screen as it should stay, and signals to whoever had them before."""
        self._display.close()
        self.release()


def drive(
    folder: Path,
    laps: float = 1.0,
    seconds: float = TIMEOUT_S,
    settings: Sections | None = None,
) -> tuple[RunMetrics, Watch]:
    """Drive `laps`, at most `seconds`, leaving the files of `cogmap run` in `folder`; `settings`
    are those that are not the default's.

    Ctrl-C ends the process. Raises CogmapError if the robot never moved.
    """
    began_s = time.monotonic()
    display = display_on(Console(stderr=True))
    stop = TimedStop(display, seconds)

    with fork_server() as server:
        choices = Choices(laps=laps)
        sections = effective(settings or {}, choices, observer=True)
        run = Drive(
            folder,
            free_endpoint(),
            "agent",
            choices,
            sections,
            began_s=began_s,
            limit_s=TIMEOUT_S,
            limits_start=True,
            server=server,
        )
        try:
            watch, ending = run.run(stop, stop)
        finally:
            stop.close()

    if ending.outcome is Outcome.INTERRUPTED and stop.interrupted:
        sys.exit(130)

    driven = summary.finish(run, watch, ending)
    if not driven.commands:
        raise CogmapError("the drive gave no motor command: `cogmap doctor` finds the reason")

    return driven, watch


def recording(folder: Path) -> Summary:
    """Read the recorder's summary of the drive in `folder`. Raises CogmapError if it has none."""
    about = LogReader(folder / LOG_NAME).about(SUMMARY)

    if not about:
        raise CogmapError(
            "the recorder was killed before it had finished: run the benchmark on an idle machine"
        )

    return msgspec.json.decode(about["json"], type=Summary)
