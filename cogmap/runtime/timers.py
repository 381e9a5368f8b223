"""What a shell does by the clock."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

Due = Callable[[int], None]


@dataclass
class _Job:
    at_ns: int
    period_ns: int
    due: Due


class Timers:
    """Periodic jobs on the thread that asks for them. One that comes late is not made up for."""

    def __init__(self, jobs: list[tuple[int, Due]]) -> None:
        now_ns = time.monotonic_ns()
        self._jobs = [_Job(now_ns + period_ns, period_ns, due) for period_ns, due in jobs]

    def run_due(self) -> float | None:
        """Run what is due; seconds until the next is, None where there is none."""
        if not self._jobs:
            return None
        now_ns = time.monotonic_ns()
        for job in self._jobs:
            if now_ns >= job.at_ns:
                job.at_ns += job.period_ns * (1 + (now_ns - job.at_ns) // job.period_ns)
                job.due(now_ns)
        next_ns = min(job.at_ns for job in self._jobs)
        return max(0, next_ns - time.monotonic_ns()) / 1e9
