"""`cogmap run` as users run it: real processes, a real router."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cogmap.bus.session import free_endpoint
from tests.support.system import processes

COGMAP = [sys.executable, "-m", "cogmap.cli.main"]
TIMEOUT_S = 90.0
DRIVING = "path integration alone"
# What the command lines of those that are no modules have in them.
WORDS = {"router": "\0router\0", "recorder": "\0log\0record\0"}


def processes_at(endpoint: str, words: str = "") -> list[int]:
    """Every process with `endpoint`, and `words`, in its command line."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        command = _command(entry)
        if endpoint in command and words in command:
            found.append(int(entry.name))
    return found


def _command(entry: Path) -> str:
    """The command line of a process, its words ended by NUL; empty where it has ended."""
    try:
        return (entry / "cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return ""


def wait_until(condition: Callable[[], bool], what: str) -> None:
    """Poll until `condition` holds, as long as a drive may take to start."""
    processes.wait_until(condition, what, TIMEOUT_S)


def answered(verb: str, endpoint: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A verb of `cogmap` at an endpoint, once it has ended."""
    return subprocess.run(
        [*COGMAP, verb, *arguments, "--connect", endpoint],
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )


class Run:
    """A `cogmap run` in a new folder, without a terminal."""

    def __init__(self, folder: Path, *arguments: str, file_limit_bytes: int | None) -> None:
        self.folder = folder
        self.endpoint = free_endpoint()
        options = ["--out", str(folder), "--connect", self.endpoint, *arguments]
        self._output = folder.with_suffix(".txt").open("w+")
        self.process = subprocess.Popen(
            [*COGMAP, "run", *options], stdout=self._output, stderr=subprocess.STDOUT
        )
        if file_limit_bytes is not None:
            limits = (file_limit_bytes, file_limit_bytes)
            resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, limits)

    def output(self) -> str:
        """All that it has printed."""
        return Path(self._output.name).read_text()

    def summary(self) -> dict[str, Any]:
        """What it left in summary.json."""
        text = (self.folder / "summary.json").read_text()
        summary: dict[str, Any] = json.loads(text)
        return summary

    def end(self) -> int:
        """Wait for its end, and return its exit code."""
        return self.process.wait(TIMEOUT_S)

    def wait_for(self, sentence: str) -> None:
        """Wait until it has printed `sentence`."""

        def printed() -> bool:
            output = self.output()
            assert self.process.poll() is None, output
            return sentence in output

        wait_until(printed, f"it prints {sentence!r}")

    def pid_of(self, instance: str) -> int | None:
        """The process of a module's instance, or of the router or the recorder; None where it does
        not run.
        """
        words = WORDS.get(instance, f"\0--instance\0{instance}\0")
        pids = processes_at(self.endpoint, words)
        return pids[0] if pids else None

    def kill(self, *instances: str) -> None:
        """Kill these processes together, and wait until each runs again."""
        pids = {instance: self.pid_of(instance) for instance in instances}
        for instance, pid in pids.items():
            assert pid is not None, f"{instance} does not run"
            os.kill(pid, signal.SIGKILL)

        for instance, pid in pids.items():
            self._await_another(instance, pid)

    def close(self) -> None:
        """End it, if it has not ended."""
        if self.process.poll() is None:
            self.process.terminate()
            self.end()
        self._output.close()

    def _await_another(self, instance: str, killed: int | None) -> None:
        """Wait until another process of an instance runs than the one that was killed."""

        def runs() -> bool:
            return self.pid_of(instance) not in (killed, None)

        wait_until(runs, f"{instance} is restarted")
