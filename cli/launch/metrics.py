"""The figures of a run: what `summary.json` holds."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from cli.launch.observer import Errors, Observer
from cli.launch.watch import Watch
from cogmap.errors import LogError
from cogmap.graph.graph import Graph
from cogmap.recording.recorder import Summary
from cogmap.recording.storage.format import SUMMARY
from cogmap.recording.storage.reader import LogReader
from schemas.graph import Node


class ErrorFigures(msgspec.Struct, kw_only=True):
    """Of the distances from the truth at the same stamps, in metres."""

    mean_m: float
    max_m: float
    final_m: float

    @classmethod
    def of(cls, errors_m: npt.NDArray[np.float64]) -> ErrorFigures:
        """Figures of (n,) distances; all 0 where there is none."""
        if not errors_m.size:
            return cls(mean_m=0.0, max_m=0.0, final_m=0.0)
        return cls(
            mean_m=float(errors_m.mean()), max_m=float(errors_m.max()), final_m=float(errors_m[-1])
        )


class Recording(msgspec.Struct, kw_only=True):
    """How the recording went. `gaps` are sentences; `never_drop_whole` says that no NEVER_DROP
    topic lacks any.
    """

    messages: int
    size_mb: float
    never_drop_whole: bool
    gaps: list[str]

    @classmethod
    def read(cls, path: Path) -> Recording | None:
        """From the log at `path`; None where it was not finished."""
        try:
            about = LogReader(path).about(SUMMARY)
        except LogError:
            return None
        if not about:
            return None
        summary = msgspec.json.decode(about["json"], type=Summary)
        return cls(
            messages=sum(summary.messages.values()),
            size_mb=path.stat().st_size / 1e6,
            never_drop_whole=summary.never_drop_whole,
            gaps=summary.gaps,
        )


class Figures(msgspec.Struct, kw_only=True):
    """What one run showed. Times in seconds of the wall clock, `drive_s` of the drive's own;
    `start_s` says when, after the command began, what was there.

    `cycle_*_ms`: camera frame stamped to motor command received; `bus_share`: the part of the mean
    spent in anything but computing. `dropped` answers of codelets are in no delta, and `refused`
    says why of the last few. `gaps`: messages lost for good, by NEVER_DROP topic. `restarts` and
    `killed` name processes.
    """

    completed: bool
    ended_by: str
    seed: int
    laps: float
    mode: str
    codelets: int
    wall_s: float
    start_s: dict[str, float]
    drive_s: float
    distance_m: float
    progress: float
    error_ratio: float
    estimate: ErrorFigures
    path_integration: ErrorFigures
    estimates: int
    commands: int
    broadcasts: int
    halted: dict[str, int]
    cycle_p50_ms: float
    cycle_p99_ms: float
    bus_share: float
    objects: int
    object_error_mean_m: float
    object_error_median_m: float
    road_m2: float
    deltas: int
    dropped: int
    refused: list[str]
    gaps: dict[str, int]
    gaps_total: int
    rejected: dict[str, int]
    superseded: dict[str, int]
    restarts: dict[str, int]
    killed: list[str]
    busy: dict[str, float]
    memory_mb: dict[str, float]
    log: Recording | None


def objects(graph: Graph) -> list[Node]:
    """The object nodes that have a position, by name."""
    nodes = [graph.nodes[name] for name in sorted(graph.nodes)]
    return [
        node for node in nodes if node.kind == "object" and {"x_m", "y_m"} <= node.attributes.keys()
    ]


def position_m(node: Node) -> tuple[float, float]:
    """Where a node stands, in the agent's frame."""
    return float(node.attributes["x_m"]), float(node.attributes["y_m"])


def object_errors_m(observer: Observer, graph: Graph) -> npt.NDArray[np.float64]:
    """How far each learned object is from the building of its name, (n,); a name no building has
    counts for none.
    """
    buildings = (
        {building.name: building.pose for building in observer.town.buildings}
        if observer.town
        else {}
    )
    errors = []
    for node in objects(graph):
        building = buildings.get(str(node.attributes.get("label", "")))
        if building is not None:
            (x_m, y_m), *_ = observer.to_world(np.array([position_m(node)])).tolist()
            errors.append(math.hypot(x_m - building.x_m, y_m - building.y_m))
    return np.array(errors)


def measured(watch: Watch, errors: Errors) -> dict[str, Any]:
    """The figures that come from the bus. Of nothing, a mean and a percentile are 0."""
    observer = watch.observer
    graph = watch.replica.graph
    health = watch.health
    gaps = watch.gaps()
    cycle_ms = watch.cycle_ms or [0.0]
    off_m = object_errors_m(observer, graph)
    return {
        "drive_s": observer.elapsed_s,
        "distance_m": observer.travelled_m,
        "progress": observer.progress,
        "error_ratio": errors.ratio,
        "estimate": ErrorFigures.of(errors.estimate_m),
        "path_integration": ErrorFigures.of(errors.integration_m),
        "estimates": int(errors.stamps_ns.size),
        "commands": len(watch.cycle_ms),
        "broadcasts": watch.broadcasts,
        "halted": dict(watch.halted),
        "cycle_p50_ms": float(np.percentile(cycle_ms, 50)),
        "cycle_p99_ms": float(np.percentile(cycle_ms, 99)),
        "bus_share": sum(watch.bus_ms) / max(1e-9, sum(cycle_ms)),
        "objects": len(objects(graph)),
        "object_error_mean_m": float(off_m.mean()) if off_m.size else 0.0,
        "object_error_median_m": float(np.median(off_m)) if off_m.size else 0.0,
        "road_m2": sum(int((tile.columns["road"] > 0.5).sum()) for tile in graph.tiles.values())
        * graph.cell_m**2,
        "deltas": graph.version,
        "dropped": watch.dropped,
        "refused": list(watch.refused),
        "gaps": gaps,
        "gaps_total": sum(gaps.values()),
        "rejected": watch.rejected(),
        "superseded": {
            name: sum(each.superseded.values()) for name, each in sorted(health.items())
        },
        "busy": watch.busy,
        "memory_mb": {name: each.memory_mb for name, each in sorted(health.items())},
    }
