"""Starts processes, restarts those that die, and ends them all."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cogmap.errors import UsageError

FIRST_BACKOFF_S = 0.2
LONGEST_BACKOFF_S = 5.0
STEADY_S = 10.0
USAGE_EXIT = 2
_SOURCES = Path(__file__).parents[2]


@dataclass(frozen=True)
class Program:
    """A process to run: the name of its instance, which names its log file too, and its command
    line.

    `command` is told how often it has been started before.
    """

    instance: str
    command: Callable[[int], Sequence[str]]


def cogmap_command(*arguments: str) -> list[str]:
    """The command line of `cogmap` itself, with the Python and the sources of this process."""
    return [sys.executable, "-P", "-m", "cli.main", *arguments]


def _environment() -> dict[str, str]:
    """This process's, with one thread a process for linear algebra: there are more processes than
    cores.
    """
    path = os.pathsep.join(filter(None, [str(_SOURCES), os.environ.get("PYTHONPATH", "")]))
    return os.environ | {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


class Child:
    """One program as it runs. Its standard input is a pipe that ends when this process does,
    however it does.
    """

    def __init__(self, program: Program, folder: Path) -> None:
        self.program = program
        self._log = folder / f"{program.instance}.log"
        self._backoff_s = FIRST_BACKOFF_S
        self._due_s: float | None = None
        self.starts = 0
        self.start()

    def start(self) -> None:
        """Start it, in a session of its own so that a Ctrl-C here does not reach it."""
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                self.program.command(self.starts),
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=_environment(),
                start_new_session=True,
            )
        self.starts += 1
        self._started_s = time.monotonic()
        self._due_s = None

    @property
    def pid(self) -> int:
        """The process id."""
        return self._process.pid

    def restart_if_dead(self) -> bool:
        """Start it again some time after it died, later each time. True when that was now.

        Raises UsageError with its last words where it ended for a reason that a restart does not
        mend.
        """
        now_s = time.monotonic()
        code = self._process.poll()
        if code is None:
            return False
        if code == USAGE_EXIT:
            raise UsageError(f"{self.program.instance} has ended: {self._last_words()}")
        if self._due_s is None:
            if now_s - self._started_s > STEADY_S:
                self._backoff_s = FIRST_BACKOFF_S
            self._due_s = now_s + self._backoff_s
            self._backoff_s = min(LONGEST_BACKOFF_S, 2 * self._backoff_s)
        if now_s < self._due_s:
            return False
        self._close_pipe()
        self.start()
        return True

    def _last_words(self) -> str:
        lines = self._log.read_text(errors="replace").split("\n")
        return next(
            (line.removeprefix("cogmap: ") for line in reversed(lines) if line.strip()),
            "it said nothing",
        )

    def ask_to_end(self) -> None:
        """Send SIGTERM."""
        if self._process.poll() is None:
            self._process.terminate()

    def end(self, deadline_s: float) -> bool:
        """Wait until it has ended, and kill it at the deadline. True if it ended by itself."""
        try:
            self._process.wait(max(0.0, deadline_s - time.monotonic()))
            by_itself = True
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            by_itself = False
        self._close_pipe()
        return by_itself

    def _close_pipe(self) -> None:
        if self._process.stdin is not None:
            self._process.stdin.close()


class Supervisor:
    """The children of one run; `check` it often, `close` it in the end."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.children: dict[str, Child] = {}
        self.restarts: Counter[str] = Counter()
        self.killed: list[str] = []

    def start(self, program: Program) -> None:
        """Start `program`."""
        self.children[program.instance] = Child(program, self._folder)

    def check(self) -> None:
        """Restart what has died. Raises UsageError where that would not help."""
        for instance, child in self.children.items():
            if child.restart_if_dead():
                self.restarts[instance] += 1

    def end(self, instances: Iterable[str], grace_s: float) -> None:
        """End these together; those that still run after `grace_s` are killed."""
        ending = [(name, self.children.pop(name)) for name in instances if name in self.children]
        for _, child in ending:
            child.ask_to_end()
        deadline_s = time.monotonic() + grace_s
        self.killed += [name for name, child in ending if not child.end(deadline_s)]
