"""The cognitive cycle on a drive of the demo's loop, and the replay of its log."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from benchmarks.drive import drive
from benchmarks.report import Bar
from cli.launch.drive import ROUTE_COMPLETE
from cli.launch.plan import LOG_NAME
from cogmap.recording.replaying.replay import replay_into
from services import registry

REPLAYED = ("sensory", "epam", "workspace", "codelets")
BARS = {
    "cycle_p50_ms": Bar(100),
    "cycle_p99_ms": Bar(260),
    "bus_share": Bar(0.25),
    "replay_speed": Bar(5, at_least=True),
    "error_ratio": Bar(0.33),
}


def measure(folder: Path, tell: Callable[[str], None]) -> dict[str, float]:
    """The figures of one drive; `replay_same` and `route_complete` are 1 where it is so."""
    tell("driving one lap in real time")
    figures, _ = drive(folder)
    tell(f"replaying it through {', '.join(REPLAYED)}")
    replay = replay_into(folder / LOG_NAME, REPLAYED, registry.build)
    if not replay.same:
        tell(f"the replay differs: {replay.first}")
    return {
        "cycle_p50_ms": figures.cycle_p50_ms,
        "cycle_p99_ms": figures.cycle_p99_ms,
        "bus_share": figures.bus_share,
        "replay_speed": replay.speed,
        "error_ratio": figures.error_ratio,
        "replay_same": float(replay.same),
        "route_complete": float(figures.ended_by == ROUTE_COMPLETE),
        "drive_s": figures.drive_s,
        "cycles": float(figures.commands),
    }
