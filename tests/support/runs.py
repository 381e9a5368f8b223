"""`cogmap run` as users run it: real processes, a real router."""

from __future__ import annotations

import json
import os
import resource
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cogmap.bus.session import free_endpoint

COGMAP = [sys.executable, "-m", "cli.main"]
POOLS = ("sem.mp-", "sem.loky-", "joblib_")
TIMEOUT_S = 90.0
DRIVING = "path integration alone"


def processes_at(endpoint: str, words: str = "") -> list[int]:
    """Every process with `endpoint`, and `words`, in its command line."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            command = (entry / "cmdline").read_bytes().decode(errors="replace")
            state = (entry / "stat").read_text().rpartition(")")[2].split()[0]
        except (OSError, IndexError):
            continue
        if entry.name.isdigit() and endpoint in command and words in command and state != "Z":
            found.append(int(entry.name))
    return found


def shared_memory() -> set[Path]:
    """Files in shared memory, but for those of pools of processes, which no module uses."""
    return {path for path in Path("/dev/shm").iterdir() if not path.name.startswith(POOLS)}


def wait_until(condition: Callable[[], bool]) -> None:
    """Look every 20 ms whether `condition` holds."""
    deadline_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline_s, "it never happened"
        select.select([], [], [], 0.02)


class Run:
    """A `cogmap run` in a new folder, without a terminal."""

    def __init__(self, folder: Path, *arguments: str, file_limit_bytes: int | None) -> None:
        self.folder = folder
        self.endpoint = free_endpoint()
        command = [*COGMAP, "run", "--out", str(folder), "--connect", self.endpoint, *arguments]
        self._output = folder.with_suffix(".txt").open("w+")
        self.process = subprocess.Popen(command, stdout=self._output, stderr=subprocess.STDOUT)
        if file_limit_bytes is not None:
            limits = (file_limit_bytes, file_limit_bytes)
            resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, limits)

    def output(self) -> str:
        """All that it has printed."""
        return Path(self._output.name).read_text()

    def summary(self) -> dict[str, Any]:
        """What it left in summary.json."""
        summary: dict[str, Any] = json.loads((self.folder / "summary.json").read_text())
        return summary

    def end(self) -> int:
        """Wait for its end, and return its exit code."""
        return self.process.wait(TIMEOUT_S)

    def wait_for(self, sentence: str) -> None:
        """Wait until it has printed `sentence`."""

        def printed() -> bool:
            assert self.process.poll() is None, self.output()
            return sentence in self.output()

        wait_until(printed)

    def pid_of(self, instance: str) -> int | None:
        """The process of a module's instance, or of the router or the recorder; None where it does
        not run.
        """
        words = {"router": "\0router\0", "recorder": "\0log\0record\0"}.get(
            instance, f"\0--instance\0{instance}\0"
        )
        return next(iter(processes_at(self.endpoint, words)), None)

    def kill(self, *instances: str) -> None:
        """Kill these processes together, and wait until each runs again."""
        pids = {instance: self.pid_of(instance) for instance in instances}
        for pid in pids.values():
            assert pid is not None
            os.kill(pid, signal.SIGKILL)

        wait_until(lambda: all(self.pid_of(name) not in (pid, None) for name, pid in pids.items()))

    def close(self) -> None:
        """End it, if it has not ended."""
        if self.process.poll() is None:
            self.process.terminate()
            self.end()
        self._output.close()
