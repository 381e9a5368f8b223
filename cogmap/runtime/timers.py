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

    def run(self, now_ns: int) -> None:
        """Run it, and leave out the periods that have passed."""
        passed = 1 + (now_ns - self.at_ns) // self.period_ns
        self.at_ns += passed * self.period_ns
        self.due(now_ns)


class Timers:
    """Periodic jobs (period in ns, what to call) on the thread that runs them.

    A job that is late is run once, however many periods have passed.
    """

    def __init__(self, jobs: list[tuple[int, Due]]) -> None:
        now_ns = time.monotonic_ns()
        self._jobs = [_Job(now_ns + period_ns, period_ns, due) for period_ns, due in jobs]

    def run_due(self) -> float | None:
        """Run what is due. Returns seconds until the next is, None if there is none."""
        if not self._jobs:
            return None

        now_ns = time.monotonic_ns()
        for job in self._jobs:
            if now_ns >= job.at_ns:
                job.run(now_ns)

        next_ns = min(job.at_ns for job in self._jobs)
        left_ns = next_ns - time.monotonic_ns()
        return max(0, left_ns) / 1e9
