"""A `cogmap run` of its own on this machine: its processes, its endpoint and what it writes."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from cogmap.bus.session import DEFAULT_AGENT, free_endpoint, listens
from cogmap.cli.launch.command_line import cogmap_command, environment

END_S = 30.0
POLL_S = 0.1
PERCEPT_LEVEL = ("--set", "sim.sensing=percepts", "--set", "planning.explore=true")
"""Nothing is rendered: so a drive takes little of the machine."""


class RunningSystem:
    """A drive in the new `folder`, at a free endpoint of this machine, without a terminal.

    It is ended when this leaves its `with` statement, and at the latest after `limit_s`.
    """

    agent = DEFAULT_AGENT

    def __init__(self, folder: Path, limit_s: float, arguments: Sequence[str]) -> None:
        self.folder = folder
        self.endpoint = free_endpoint()
        self.output = folder.with_suffix(".txt")
        given = ("--connect", self.endpoint, "--out", str(folder), "--time-limit", f"{limit_s:.0f}")
        with self.output.open("wb") as output:
            self._process = subprocess.Popen(
                cogmap_command("run", *given, *arguments),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=environment(),
            )

    def __enter__(self) -> RunningSystem:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.end()

    @property
    def has_ended(self) -> bool:
        """Return whether the drive is over, for whatever reason."""
        return self._process.poll() is not None

    @property
    def last_line(self) -> str:
        """Return what the drive has shown last."""
        lines = self.output.read_text(errors="replace").splitlines()
        return lines[-1].strip() if lines else ""

    def end(self) -> None:
        """Kill it, which takes no time for a summary, and wait until its processes have ended: the
        router is the last of them.
        """
        self._process.kill()
        self._process.wait()
        port = int(self.endpoint.rpartition(":")[2])
        until_s = time.monotonic() + END_S
        while listens(port) and time.monotonic() < until_s:
            time.sleep(POLL_S)

    def sizes(self) -> dict[Path, int]:
        """Return how long each text that it writes is by now."""
        return {path: path.stat().st_size for path in self._texts()}

    def lines_since(self, sizes: dict[Path, int]) -> list[str]:
        """Return the lines that it has written since, each after the name of its file."""
        found = []
        for path in self._texts():
            with path.open("rb") as file:
                file.seek(sizes.get(path, 0))
                text = file.read().decode(errors="replace")
            found += [f"{path.stem}: {line}" for line in text.splitlines() if line.strip()]
        return found

    def _texts(self) -> list[Path]:
        return sorted(path for path in (*self.folder.glob("*.log"), self.output) if path.exists())
