"""The cycle on a drive of the demo's loop, the replay of its log, and the agent's error."""

from __future__ import annotations

from benchmarks.benchmark import Setting
from benchmarks.cycle import ten_hertz
from benchmarks.cycle.position_error import TOWNS, over_fused
from benchmarks.drive import drive
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.recording.replaying.replay import replay_into
from cogmap.recording.storage.format import LOG_NAME
from cogmap.services import registry

REPLAYED = ("sensory", "epam", "workspace", "codelets")
THRESHOLDS = {
    "cycle_p50_ms": at_most(60),
    "cycle_p99_ms": at_most(130),
    "bus_share": at_most(0.25),
    "start_s": at_most(3),
    "cycle_p50_ms_10hz": at_most(60),
    "superseded_share": at_most(0.01),
    "replay_speed": at_least(8),
    "error_ratio": at_most(0.15),
    "error_over_fused": at_most(0.6),
}


def measure(setting: Setting) -> Metrics:
    """Measure the cycle's latency, the bus's share of it, the speed of a replay, and the error of
    the estimate.

    Drives a lap of the demo's town in real time, every module a process, records it, and replays
    the log through sensory, epam, workspace and codelets. Then it drives three laps of three towns
    in lockstep, to compare the estimate with fused self-motion alone. Takes about six minutes.
    """
    # `error_ratio` is over raw wheels, on one lap; `error_over_fused` is over fused self-motion, on
    # three. `start_s` is from the start of a drive to its first command.
    folder = setting.folder
    announce = setting.announce
    announce("driving one lap in real time")
    driven, _ = drive(folder)
    assert driven.error_ratio is not None, "a lap is driven, with noise of the wheels"

    announce(f"driving with {ten_hertz.FRAME_HZ} camera frames a second")
    at_ten_hertz = ten_hertz.measure(folder / "ten_hertz")

    announce(f"replaying it through {', '.join(REPLAYED)}")
    replay = replay_into(folder / LOG_NAME, REPLAYED, registry.build)

    if not replay.same:
        announce(f"the replay differs: {replay.first}")

    announce(f"driving three laps of {len(TOWNS)} towns in lockstep")
    errors = over_fused(setting.processes)

    metrics = {
        "cycle_p50_ms": driven.cycle_p50_ms,
        "cycle_p99_ms": driven.cycle_p99_ms,
        "bus_share": driven.bus_share,
        "start_s": driven.start_s["first command"],
        "replay_speed": replay.speed,
        "error_ratio": driven.error_ratio,
        "replay_same": float(replay.same),
        "route_complete": float(driven.completed),
        "drive_s": driven.drive_s,
        "cycles": float(driven.commands),
    }
    return metrics | at_ten_hertz | errors
