"""A drive of the whole agent in processes of its own, and a recorder beside it to be stopped."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil

from cogmap.bus.session import free_endpoint
from cogmap.errors import CogmapError

AGENT = "stall"
ENDLESS_S = 100_000
END_S = 30.0
POLL_S = 0.1


def wait(seconds: float) -> None:
    """Wait so long; nothing at all if it is negative."""
    threading.Event().wait(max(0.0, seconds))


def wait_until(condition: Callable[[], bool], end_s: float, what: str) -> None:
    """Poll until `condition` holds. Raises CogmapError if it does not by `end_s`."""
    while not condition():
        if time.monotonic() > end_s:
            raise CogmapError(f"the time limit was over before {what}: allow more")
        wait(POLL_S)


class Program:
    """A `cogmap` process, whose output is in `log`; it ends when this process does."""

    def __init__(self, log: Path, *arguments: str) -> None:
        self.log = log
        with log.open("wb") as output:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "cogmap.cli.main", *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=output,
                start_new_session=True,
            )

    @property
    def memory_mb(self) -> float:
        """Return its resident memory, in 10^6 bytes."""
        return float(psutil.Process(self._process.pid).memory_info().rss) / 1e6

    def send(self, number: signal.Signals) -> None:
        """Send it a signal. Raises CogmapError if it has ended."""
        if self._process.poll() is not None:
            raise CogmapError(f"{self.log.stem} has ended: {self.log.read_text()[-500:]}")
        os.kill(self._process.pid, number)

    def end(self) -> bytes:
        """Ask it to end, and return what it printed. Raises CogmapError if it fails."""
        self.send(signal.SIGTERM)
        try:
            printed, _ = self._process.communicate(timeout=END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise CogmapError(f"{self.log.stem} did not end within {END_S:g} s") from None

        code = self._process.returncode
        if code != 0:
            said = self.log.read_text()[-500:]
            raise CogmapError(f"{self.log.stem} ended with {code}: {said}")
        return printed

    def abandon(self) -> None:
        """End it, whatever it does: first by the end of its input."""
        if self._process.poll() is not None:
            return
        self.send(signal.SIGCONT)
        try:
            self._process.communicate(timeout=END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()


class Agent:
    """A router, and an agent that explores a town at percept level, without end."""

    def __init__(self, folder: Path, seed: int, is_lockstep: bool) -> None:
        self._folder = folder
        self.endpoint = free_endpoint()
        self._connect = ("--connect", self.endpoint, "--tied")
        self.router = Program(folder / "router.log", "router", *self._connect)
        mode = "--lockstep" if is_lockstep else "--real-time"
        self._drive = Program(
            folder / "drive.log",
            *("run", mode, "--no-record", "--json", "--tied"),
            *("--set", "sim.sensing=percepts", "--town", "blocks", "--seed", str(seed)),
            *("--explore", str(ENDLESS_S), "--time-limit", str(ENDLESS_S)),
            *("--out", str(folder / "run"), "--router", self.endpoint, "--agent", AGENT),
        )

    def recorder(self, name: str) -> Recorder:
        """Start a recorder of all never-drop messages."""
        return Recorder(self._folder, name, self._connect)

    def close(self) -> None:
        """End all processes."""
        self._drive.abandon()
        self.router.abandon()


class Recorder:
    """A recorder, into the log at `path`."""

    def __init__(self, folder: Path, name: str, connect: tuple[str, ...]) -> None:
        self.path = folder / f"{name}.mcap"
        self.program = Program(
            folder / f"{name}.log",
            *("log", "record", "--json", "--instance", name, "-o", str(self.path)),
            *("-x", "camera|view|scan|pose|health|clock", "--agent", AGENT, *connect),
        )

    @property
    def has_begun(self) -> bool:
        """Return whether it has written something beside the beginning of its file."""
        return self.path.exists() and self.path.stat().st_size > 100_000

    def finish(self) -> dict[str, Any]:
        """End it, and return its summary."""
        summary: dict[str, Any] = json.loads(self.program.end())
        return summary
