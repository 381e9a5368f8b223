"""The drives that a dashboard shows: `cogmap run`, as users run it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from pathlib import Path

from cogmap.bus.session import free_endpoint
from cogmap.errors import CogmapError
from cogmap.recording.storage.format import LOG_NAME

COGMAP = (sys.executable, "-m", "cogmap.cli.main")
ADDRESS = re.compile(r"dashboard.*(http://\S+)")
LIMIT_S = 600.0
LOOK_S = 0.05
LONG_S = 600


class Driven:
    """A `cogmap run` that leaves its files in `folder`."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.folder = folder
        folder.parent.mkdir(parents=True, exist_ok=True)
        self._output = folder.with_suffix(".txt").open("w+")
        options = ("--out", str(folder), "--connect", free_endpoint(), *arguments)
        self._process = subprocess.Popen(
            [*COGMAP, "run", *options], stdout=self._output, stderr=subprocess.STDOUT
        )

    @property
    def log(self) -> Path:
        """Return the path of its log."""
        return self.folder / LOG_NAME

    def address(self) -> str:
        """Return the address of its dashboard, once it serves. Raises CogmapError if it ends."""
        while self.is_running():
            found = ADDRESS.search(self._said())
            if found is not None:
                return found[1]
            time.sleep(LOOK_S)
        raise CogmapError(f"the drive ended before it served its dashboard: {self._said()}")

    def is_running(self) -> bool:
        """Return whether the drive goes on."""
        return self._process.poll() is None

    def end(self) -> None:
        """Wait for its end. Raises CogmapError if it takes too long."""
        try:
            self._process.wait(LIMIT_S)
        except subprocess.TimeoutExpired:
            self._process.terminate()
            self._process.wait()
            raise CogmapError(f"the drive did not end in {LIMIT_S:g} s: {self._said()}") from None

    def cycle_p50_ms(self) -> float:
        """Return the median time from a frame to the command that answers it, of its summary.
        Raises CogmapError if it left none.
        """
        try:
            summary = json.loads((self.folder / "summary.json").read_text("utf-8"))
        except FileNotFoundError:
            raise CogmapError(f"the drive left no summary: {self._said()}") from None
        return float(summary["cycle_p50_ms"])

    def _said(self) -> str:
        return Path(self._output.name).read_text("utf-8")


def long_log(folder: Path) -> Path:
    """Drive LONG_S of simulated time in lockstep, at the level of percepts. Returns the log."""
    settings = ("sim.sensing=percepts", f"sim.duration_s={LONG_S}")
    options = [word for setting in settings for word in ("--set", setting)]
    driven = Driven(folder, "--lockstep", "--town", "blocks", *options)
    driven.end()
    return driven.log
