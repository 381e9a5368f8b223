"""Starts processes, restarts those that die, and ends them all."""

from __future__ import annotations

import os
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Protocol

from cogmap.cli.launch.command_line import arguments_of, environment
from cogmap.cli.launch.forking.client import ForkServer
from cogmap.errors import ProcessFailedError

MIN_BACKOFF_S = 0.2
MAX_BACKOFF_S = 5.0
STEADY_S = 10.0
MAX_QUICK_DEATHS = 4
USAGE_EXIT = 2
KILL_TIMEOUT_S = 10.0


@dataclass(frozen=True)
class Program:
    """A process to run: the name of its instance, which names its log file too, and its command
    line.

    `command` receives how often it has been started before. One that is held waits for a line on
    its standard input before it joins the others. One that is not needed may fail.
    """

    instance: str
    command: Callable[[int], Sequence[str]]
    is_held: bool = False
    is_needed: bool = True

    @classmethod
    def of(cls, instance: str, command: Sequence[str], is_held: bool = False) -> Program:
        """Make a program that is started by the same command line each time."""
        return cls(instance, lambda starts: command, is_held)


class Process(Protocol):
    """What a supervisor needs of subprocess.Popen."""

    @property
    def pid(self) -> int: ...

    @property
    def stdin(self) -> IO[bytes] | None: ...

    def poll(self) -> int | None: ...

    def wait(self, timeout: float) -> int: ...

    def terminate(self) -> None: ...

    def kill(self) -> None: ...


class Child:
    """One program as it runs. Its standard input is a pipe that ends when this process does,
    whatever the cause.
    """

    def __init__(self, program: Program, folder: Path, server: ForkServer | None = None) -> None:
        self.program = program
        self.starts = 0
        self._log = folder / f"{program.instance}.log"
        self._server = server
        self._backoff_s = MIN_BACKOFF_S
        self._quick_deaths = 0
        self._due_s: float | None = None
        self._is_held = program.is_held
        self.start()

    def start(self) -> None:
        """Start it, in a session of its own so that a Ctrl-C here does not reach it.

        It is forked, if there is a server for that and it is a process of `cogmap`.
        """
        command = self.program.command(self.starts)
        arguments = arguments_of(command)
        with self._log.open("ab") as log:
            if arguments is not None and self._server is not None and self._server.is_alive:
                self._process: Process = self._server.fork(arguments, log.fileno())
            else:
                self._process = subprocess.Popen(
                    command,
                    stdin=subprocess.PIPE,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    env=environment(),
                    start_new_session=True,
                )

        self.starts += 1
        self._started_s = time.monotonic()
        self._due_s = None
        if self.program.is_held and not self._is_held:
            self._send_line()

    def release(self) -> None:
        """Hold it no longer, nor when it is started again."""
        if self._is_held:
            self._is_held = False
            self._send_line()

    def _send_line(self) -> None:
        pipe = self._process.stdin
        assert pipe is not None
        with suppress(BrokenPipeError):  # it has died, which is noticed when it is checked
            os.write(pipe.fileno(), b"\n")

    @property
    def pid(self) -> int:
        """Return the process id."""
        return self._process.pid

    def restart_if_dead(self) -> bool:
        """Start it again after it died: at once if it had lived for STEADY_S, else later each time.
        Returns whether that was now.

        Raises ProcessFailedError with its last words if a restart would not help: it ended with
        USAGE_EXIT, or has died MAX_QUICK_DEATHS times within STEADY_S of its start.
        """
        code = self._process.poll()
        if code is None:
            return False
        if self._due_s is None:
            self._due_s = self._restart_time_s(code)
        if time.monotonic() < self._due_s:
            return False

        self._close_pipe()
        self.start()
        return True

    def _restart_time_s(self, code: int) -> float:
        """Decide when to start it again after it ended with `code`, on the monotonic clock."""
        instance = self.program.instance
        lines = self._log.read_text(errors="replace").splitlines()
        written = [line for line in lines if line.strip()]
        last_words = written[-1].removeprefix("cogmap: ") if written else "none"
        if code == USAGE_EXIT:
            raise ProcessFailedError(f"{instance} has ended: {last_words}")

        now_s = time.monotonic()
        if now_s - self._started_s > STEADY_S:
            self._backoff_s = 0.0
            self._quick_deaths = 0

        self._quick_deaths += 1
        if self._quick_deaths >= MAX_QUICK_DEATHS:
            raise ProcessFailedError(
                f"{instance} died {self._quick_deaths} times soon after its start, "
                f"the last words in {self._log} are: {last_words}"
            )

        backoff_s = self._backoff_s
        self._backoff_s = min(MAX_BACKOFF_S, max(MIN_BACKOFF_S, 2 * backoff_s))
        return now_s + backoff_s

    def ask_to_end(self) -> None:
        """Send SIGTERM."""
        if self._process.poll() is None:
            self._process.terminate()

    def end(self, deadline_s: float) -> bool:
        """Wait until it has ended; kill it at the deadline. Returns whether it ended by itself."""
        try:
            self._process.wait(max(0.0, deadline_s - time.monotonic()))
            by_itself = True
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait(KILL_TIMEOUT_S)
            by_itself = False

        self._close_pipe()
        return by_itself

    def _close_pipe(self) -> None:
        if self._process.stdin is not None:
            self._process.stdin.close()


class Supervisor:
    """The children of one run, whose logs are in `folder`; `check` it often, `end` them all.

    A `server` forks those that are processes of `cogmap`; without one, each is a new Python.
    """

    def __init__(self, folder: Path, server: ForkServer | None = None) -> None:
        self._folder = folder
        self._server = server
        self.children: dict[str, Child] = {}
        self.restarts: Counter[str] = Counter()
        self.killed: list[str] = []

    def start(self, program: Program) -> None:
        """Start `program`."""
        self.children[program.instance] = Child(program, self._folder, self._server)

    def release(self) -> None:
        """Let those that are held join the others."""
        for child in self.children.values():
            child.release()

    def check(self) -> None:
        """Restart what has died. Raises ProcessFailedError if that would not help one that is
        needed.
        """
        for instance, child in list(self.children.items()):
            try:
                if child.restart_if_dead():
                    self.restarts[instance] += 1
            except ProcessFailedError:
                if child.program.is_needed:
                    raise
                del self.children[instance]

    def end(self, instances: Iterable[str], grace_s: float) -> None:
        """End these together; those that still run after `grace_s` are killed."""
        ending = [(name, self.children.pop(name)) for name in instances if name in self.children]
        for _, child in ending:
            child.ask_to_end()

        deadline_s = time.monotonic() + grace_s
        for name, child in ending:
            if not child.end(deadline_s):
                self.killed.append(name)
