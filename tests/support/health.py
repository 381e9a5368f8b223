"""Reports of how a process fares, for tests."""

from __future__ import annotations

from cogmap.schemas.process import Health


def report(module: str, uptime_s: float = 1.0, ready: bool = True) -> Health:
    """What a process of `module` says that fares well, and has received nothing yet."""
    return Health(
        module=module,
        instance=module,
        ready=ready,
        uptime_s=uptime_s,
        received={},
        emitted={},
        rejected={},
        superseded={},
        gaps={},
        queued=0,
        busy=0.1,
        compute_p50_ms=1.0,
        compute_p99_ms=1.0,
        memory_mb=50.0,
    )
