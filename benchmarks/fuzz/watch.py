"""One call at a time, watched: what it raises, how long it takes, how much memory."""

from __future__ import annotations

import os
import signal
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from cogmap.errors import CogmapError
from cogmap.files.bounds import MIB

HANG_S = 1.0
"""A call that computes for longer hangs."""

GIVEN_UP_S = 20.0
"""After so long it is ended."""

BOUND_MB = 512
"""Reading a file of less than 512 KiB takes at most so much memory."""


class HangError(BaseException):
    """A call was given up."""


@dataclass
class Findings:
    """What was found. `crashes` and `faults`, which are caught and counted by the shell around a
    module, by what was raised and where; the others by the topic or the format.
    """

    tried: int = 0
    refused: int = 0
    handled: int = 0
    crashes: Counter[str] = field(default_factory=Counter)
    faults: Counter[str] = field(default_factory=Counter)
    hangs: Counter[str] = field(default_factory=Counter)
    over_bound: Counter[str] = field(default_factory=Counter)
    growth_mb: float = 0.0
    slowest_s: float = 0.0
    largest_mb: float = 0.0

    def add(self, other: Findings) -> None:
        """Add what another process found."""
        self.tried += other.tried
        self.refused += other.refused
        self.handled += other.handled
        self.crashes += other.crashes
        self.faults += other.faults
        self.hangs += other.hangs
        self.over_bound += other.over_bound
        self.growth_mb = max(self.growth_mb, other.growth_mb)
        self.slowest_s = max(self.slowest_s, other.slowest_s)
        self.largest_mb = max(self.largest_mb, other.largest_mb)

    def watch(self, name: str, call: Callable[[], object]) -> None:
        """Make a call, and note whether it crashes or hangs. An error of ours is none."""
        self.tried += 1
        began_s = time.process_time()
        try:
            with _alarm():
                call()
        except CogmapError:
            self.refused += 1
        except HangError:
            self.hangs[name] += 1
        except Exception as error:
            self.crashes[f"{name}: {described(error)}"] += 1

        took_s = time.process_time() - began_s
        self.slowest_s = max(self.slowest_s, took_s)
        if HANG_S < took_s < GIVEN_UP_S:
            self.hangs[name] += 1

    def watch_memory(self, name: str, call: Callable[[], object]) -> None:
        """Do the same, and note whether it takes more memory than it may, if the system tells."""
        before_mb = rss_mb()
        is_told = _reset_peak()
        self.watch(name, call)
        if is_told:
            taken_mb = _status_mb("VmHWM") - before_mb
            self.largest_mb = max(self.largest_mb, taken_mb)
            if taken_mb > BOUND_MB:
                self.over_bound[name] += 1


def described(error: BaseException) -> str:
    """Write what was raised, and where in our own code."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if "cogmap" in frame.filename or "services" in frame.filename]
    where = ours[-1] if ours else frames[-1]
    words = " ".join(str(error).split())[:100]
    return f"{type(error).__name__} at {Path(where.filename).name}:{where.lineno}: {words}"


def rss_mb() -> float:
    """Return the resident memory of this process."""
    return _status_mb("VmRSS")


def _status_mb(key: str) -> float:
    with Path("/proc/self/status").open(encoding="ascii") as file:
        for line in file:
            if line.startswith(key):
                return int(line.split()[1]) * 1024 / MIB
    return 0.0


def _reset_peak() -> bool:
    """Let the system forget the peak of memory; return whether it can."""
    try:
        descriptor = os.open("/proc/self/clear_refs", os.O_WRONLY)
    except OSError:
        return False
    try:
        os.write(descriptor, b"5")
    except OSError:
        return False
    finally:
        os.close(descriptor)
    return True


@contextmanager
def _alarm() -> Iterator[None]:
    """Raise HangError in the block after GIVEN_UP_S of computing."""

    def give_up(number: int, frame: FrameType | None) -> None:
        raise HangError

    before = signal.signal(signal.SIGVTALRM, give_up)
    signal.setitimer(signal.ITIMER_VIRTUAL, GIVEN_UP_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
