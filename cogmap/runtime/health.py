"""What a shell tells of itself once a second."""

from __future__ import annotations

import resource
import sys
import time
from collections import Counter, deque
from pathlib import Path

from cogmap.runtime.inbox import Inbox
from cogmap.runtime.intake import Intake
from cogmap.runtime.module import Module
from schemas.process import Health

_STATM = Path("/proc/self/statm")
_RECENT = 512


def memory_mb() -> float:
    """This process's resident memory; its highest where the system tells nothing else."""
    if _STATM.exists():
        return int(_STATM.read_text().split()[1]) * resource.getpagesize() / 1e6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (
        1e6 if sys.platform == "darwin" else 1e3
    )


class Meter:
    """Counts what a module emits and the time that it takes."""

    def __init__(self, module: Module) -> None:
        self.emitted: Counter[str] = Counter()
        self.faults = 0
        self.reports = 0
        self._module = module
        self._began_s = self._reported_s = time.monotonic()
        self._busy_ns = 0
        self._compute_ns: deque[int] = deque(maxlen=_RECENT)

    def count(self, compute_ns: int, busy_ns: int) -> None:
        """Take note of one message taken in: time in the module alone, and with all around it."""
        self._compute_ns.append(compute_ns)
        self._busy_ns += busy_ns

    def report(self, intake: Intake, inbox: Inbox, ready: bool, notes: list[str]) -> Health:
        """The counts so far; the busy share since the last report."""
        now_s = time.monotonic()
        busy = self._busy_ns / 1e9 / max(1e-9, now_s - self._reported_s)
        compute_ms = sorted(ns / 1e6 for ns in self._compute_ns) or [0.0]
        self._reported_s = now_s
        self._busy_ns = 0
        self.reports += 1
        return Health(
            module=self._module.name,
            instance=self._module.instance,
            ready=ready,
            uptime_s=now_s - self._began_s,
            received=dict(intake.received),
            emitted=dict(self.emitted),
            rejected=dict(intake.rejected),
            superseded=dict(inbox.superseded),
            gaps=dict(intake.gaps),
            queued=len(inbox),
            busy=busy,
            compute_p50_ms=compute_ms[len(compute_ms) // 2],
            compute_p99_ms=compute_ms[int(len(compute_ms) * 0.99)],
            memory_mb=memory_mb(),
            notes=notes,
        )
