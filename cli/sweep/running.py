"""Runs the drives of a sweep, several at once."""

from __future__ import annotations

import tempfile
import time
from collections import deque
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path

from cogmap.bus.session import free_endpoint
from cogmap.cli.run.child import DriveProcess
from cogmap.cli.run.script import RunOptions, summary_after, words
from cogmap.cli.sweep.plan import PlannedDrive
from cogmap.errors import CogmapError
from cogmap.recording.storage.reader import Progress

POLL_S = 0.1


class RunningDrive:
    """A drive that was started, at a router of its own. `close` it, which ends it."""

    def __init__(self, drive: PlannedDrive) -> None:
        self.drive = drive
        own: RunOptions = {**drive.options, "connect": free_endpoint()}
        with ExitStack() as stack:
            self._shown = stack.enter_context(tempfile.TemporaryFile())
            given = stack.enter_context(words(own, drive.folder))
            self._process = stack.enter_context(DriveProcess(given, self._shown.fileno()))
            self._stack = stack.pop_all()

    def has_ended(self) -> bool:
        """Return whether it goes on no more."""
        return self._process.poll() is not None

    def ask_to_end(self) -> None:
        """Ask it to end in order."""
        self._process.ask_to_end()

    def error(self) -> str:
        """Return why one that has ended left no summary; empty if it did leave one."""
        self._shown.seek(0)
        shown = self._shown.read().decode(errors="replace")
        try:
            summary_after(self.drive.folder, self._process.wait(), shown)
        except CogmapError as error:
            return str(error)
        return ""

    def close(self) -> None:
        """End it, if it has not ended, and all that was for it."""
        self._stack.close()


def run_all(drives: Iterable[PlannedDrive], processes: int, progress: Progress) -> dict[Path, str]:
    """Run all `drives`, so many at once. Returns why those without a summary have none, by folder.

    `progress` is called with the share of them that have ended. KeyboardInterrupt ends those that
    go on, in order.
    """
    waiting = deque(drives)
    number = len(waiting)
    running: list[RunningDrive] = []
    errors: dict[Path, str] = {}
    try:
        while waiting or running:
            while waiting and len(running) < processes:
                running.append(RunningDrive(waiting.popleft()))

            time.sleep(POLL_S)
            for ended in [each for each in running if each.has_ended()]:
                running.remove(ended)
                error = ended.error()
                ended.close()
                if error:
                    errors[ended.drive.folder] = error
            progress(1 - (len(waiting) + len(running)) / number)
    finally:
        for each in running:
            each.ask_to_end()
        for each in running:
            each.close()
    return errors
