"""The cycle on a drive with ten camera frames a second, twice as many as there are by default."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from benchmarks.drive import drive
from benchmarks.report import Metrics
from benchmarks.timing import machine_unit_ms
from cogmap.schemas import topics
from cogmap.schemas.process import Health

FRAME_HZ = 10
DRIVE_S = 40.0
UNIT_MS = 13.0
"""The unit of the machine for which a cycle's time at this rate is scaled."""

SKIPPED = (topics.STEREO, topics.VIEW)


def measure(folder: Path) -> Metrics:
    """Measure `cycle_p50_ms_10hz`, as it is and as it would be on a machine of UNIT_MS, and
    `superseded_share`: the share of the frames that led to no percepts, as a newer one came first.
    """
    folder.mkdir()
    driven, watch = drive(folder, seconds=DRIVE_S, settings={"sim": {"frame_hz": FRAME_HZ}})
    unit_ms = machine_unit_ms()

    return {
        "cycle_p50_ms_10hz": driven.cycle_p50_ms,
        "cycle_p50_ms_10hz_scaled": driven.cycle_p50_ms * UNIT_MS / unit_ms,
        "superseded_share": superseded_share(watch.tally.health),
        "cycles_10hz": float(driven.commands),
    }


def superseded_share(health: Mapping[str, Health]) -> float:
    """Return camera frames and views superseded over frames sensed, by each process's counts."""
    frames = sum(each.emitted.get(topics.STEREO.name, 0) for each in health.values())
    superseded = 0
    for each in health.values():
        superseded += sum(each.superseded.get(topic.name, 0) for topic in SKIPPED)

    return superseded / max(1, frames)
