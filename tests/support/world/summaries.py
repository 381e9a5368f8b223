"""Summaries of drives that nobody drove."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from cogmap.cli.launch.drive_metrics import ErrorMetrics, RunMetrics, drive_metrics
from cogmap.cli.launch.tally import Tally
from cogmap.cli.run.folder import SUMMARY_NAME
from cogmap.errors import NoAnswerError
from cogmap.graph.replica import Fetched, Replica
from cogmap.schemas.graph import SnapshotRequest


def _nobody(_request: SnapshotRequest) -> Fetched:
    raise NoAnswerError("nobody is there")


def summary(mean_m: float = 1.0, **facts: Any) -> RunMetrics:
    """The summary of a drive to its end with this mean error, unless `facts` say otherwise."""
    nothing = drive_metrics(Tally(Replica(_nobody)), {}, {})
    errors = ErrorMetrics(mean_m=mean_m, max_m=2 * mean_m, final_m=0.0)
    usual: dict[str, Any] = {
        **msgspec.structs.asdict(nothing),
        "estimate": errors,
        "completed": True,
        "ended_by": "route complete",
        "reason": "the time of the drive is over",
        "town": "loop",
        "seed": 1,
        "lockstep": True,
        "codelets": 1,
        "wall_s": 1.0,
        "start_s": {},
        "restarts": {},
        "killed": [],
        "log": None,
    }
    return RunMetrics(**(usual | facts))


def write_summary(folder: Path, metrics: RunMetrics) -> None:
    """Leave a summary in the folder of a drive."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / SUMMARY_NAME).write_bytes(msgspec.json.encode(metrics))
