"""Examples of the messages about processes."""

from __future__ import annotations

from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock, Health, Presence


def messages() -> list[Message]:
    """A message of every type about processes."""
    return [
        Clock(rate=0.5),
        Presence(
            module="codelets",
            instance="codelets-2",
            alive=True,
            observer="workspace",
        ),
        _health(),
    ]


def _health() -> Health:
    return Health(
        module="workspace",
        instance="workspace",
        ready=True,
        uptime_s=61.5,
        received={"epam/percepts": 300},
        emitted={"workspace/delta": 900},
        rejected={"epam/percepts": 1},
        superseded={"camera/stereo": 2},
        gaps={"odometry": 3},
        queued=4,
        busy=0.25,
        compute_p50_ms=1.5,
        compute_p99_ms=7.25,
        memory_mb=96.5,
        notes=["1 faults: run with --verbose to see them"],
    )
