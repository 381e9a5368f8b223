"""What a shell reports of its process once a second."""

from __future__ import annotations

import time
from collections import Counter, deque

import psutil

from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.delivery.publisher import Publisher
from cogmap.runtime.module import Module
from cogmap.schemas.process import Health

# Messages by whose times p50 and p99 are computed.
_RECENT = 512


def memory_mb() -> float:
    """Return this process's resident memory, in 10^6 bytes."""
    return psutil.Process().memory_info().rss / 1e6


class Meter:
    """Measures how long a module computes; `faults` counts the handlers that failed."""

    def __init__(self, module: Module) -> None:
        self.faults = 0
        self.reports = 0
        self._module = module
        self._began_s = time.monotonic()
        self._reported_s = self._began_s
        self._busy_ns = 0
        self._compute_ns: deque[int] = deque(maxlen=_RECENT)

    def add(self, compute_ns: int, busy_ns: int) -> None:
        """Count one message: the time of its handler alone, and with all around it."""
        self._compute_ns.append(compute_ns)
        self._busy_ns += busy_ns

    def report(
        self,
        intake: Intake,
        inbox: Inbox,
        publisher: Publisher,
        *,
        queued: int,
        shed: Counter[str],
        ready: bool,
        notes: list[str],
    ) -> Health:
        """Return the counts so far and the busy share since the last report, numbered. What was
        `shed`, by topic, counts as rejected.
        """
        now_s = time.monotonic()
        since_s = max(1e-9, now_s - self._reported_s)
        busy = self._busy_ns / 1e9 / since_s
        self._reported_s = now_s
        self._busy_ns = 0

        seq = self.reports
        self.reports += 1
        return Health(
            seq=seq,
            source=self._module.instance,
            stamp_ns=time.time_ns(),
            module=self._module.name,
            instance=self._module.instance,
            ready=ready,
            uptime_s=now_s - self._began_s,
            received=dict(intake.received),
            emitted=dict(publisher.emitted),
            rejected=dict(intake.rejected + shed),
            superseded=dict(inbox.superseded),
            gaps=dict(intake.gaps),
            queued=queued,
            busy=busy,
            compute_p50_ms=self._compute_ms(0.5),
            compute_p99_ms=self._compute_ms(0.99),
            memory_mb=memory_mb(),
            notes=notes,
        )

    def _compute_ms(self, quantile: float) -> float:
        """Return a quantile of the time that recent messages took."""
        if not self._compute_ns:
            return 0.0
        ordered = sorted(self._compute_ns)
        return ordered[int(len(ordered) * quantile)] / 1e6
