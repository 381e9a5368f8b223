"""The metrics of a drive: what `summary.json` holds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from cogmap.cli.launch.goals import unreached
from cogmap.cli.launch.individuals.judge import (
    RIGHT_M,
    SEEN_VIEWS,
    BuildingMetrics,
    Judgement,
    judge,
)
from cogmap.cli.launch.tally import EnergyMetrics, Tally
from cogmap.cli.progress import bar
from cogmap.errors import LogError
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.recording.completeness import Completeness, Published, completeness, never_drop
from cogmap.recording.recorder import Summary
from cogmap.recording.storage.format import SUMMARY
from cogmap.recording.storage.reader import LogReader
from cogmap.schemas.nodes import ROOT_MAP, Object, PlaceColumn

ROAD_THRESHOLD = 0.5


class ErrorMetrics(msgspec.Struct, kw_only=True):
    """Of distances from the true positions of the same stamps, in metres."""

    mean_m: float
    max_m: float
    final_m: float

    @classmethod
    def of(cls, errors_m: Floats) -> ErrorMetrics:
        """Compute the metrics of (n,) distances; all 0 if there is none: nothing was measured."""
        if not errors_m.size:
            return cls(mean_m=0.0, max_m=0.0, final_m=0.0)
        return cls(
            mean_m=float(errors_m.mean()),
            max_m=float(errors_m.max()),
            final_m=float(errors_m[-1]),
        )

    @property
    def is_measured(self) -> bool:
        """Return whether there was anything to compare: a path that was compared is never exact."""
        return self.max_m > 0.0


class Recording(msgspec.Struct, kw_only=True):
    """How the recording went, in one log or, where the recorder was killed, in several. `gaps` are
    sentences; `lost` are the NEVER_DROP messages that no log holds, by topic; `never_drop_whole` is
    whether there are none. Of a log that was not finished, `messages` are those of NEVER_DROP
    topics.
    """

    messages: int
    size_mb: float
    never_drop_whole: bool
    gaps: list[str]
    lost: dict[str, int] = {}
    logs: int = 1

    @classmethod
    def read(cls, path: Path) -> Recording | None:
        """Read it from the log at `path`; None if that was not finished, or cannot be read."""
        summary = _summary_in(path)
        if summary is None:
            return None

        found = Completeness(never_drop(summary.lost), summary.gaps)
        return cls.of([path], sum(summary.messages.values()), found)

    @classmethod
    def of_run(cls, paths: Sequence[Path], published: Published) -> Recording | None:
        """Read it from the logs of a run in which so much was `published`; None if there is none.

        The summary of one that was finished is enough; others are read.
        """
        summary = _summary_in(paths[0]) if len(paths) == 1 else None
        if summary is not None:
            found = Completeness(never_drop(summary.lost), list(summary.gaps))
            found.compare(summary.reached, published)
            return cls.of(paths, sum(summary.messages.values()), found)
        if not paths:
            return None

        with bar("reading what the logs lack") as progress:
            found = completeness(paths, published, progress)
        return cls.of(paths, found.messages, found)

    @classmethod
    def of(cls, paths: Sequence[Path], messages: int, found: Completeness) -> Recording:
        """Make it of what was found in the logs."""
        size_bytes = sum(path.stat().st_size for path in paths)
        return cls(
            messages=messages,
            size_mb=size_bytes / 1e6,
            never_drop_whole=not found.lost,
            gaps=found.gaps,
            lost=found.lost,
            logs=len(paths),
        )


def _summary_in(path: Path) -> Summary | None:
    """Return the recorder's summary in a log; None if it was not finished, or cannot be read."""
    try:
        about = LogReader(path).about(SUMMARY)
        return msgspec.json.decode(about.get("json", ""), type=Summary)
    except (LogError, msgspec.DecodeError):
        return None


class DriveMetrics(msgspec.Struct, kw_only=True):
    """What the messages of a drive show. `drive_s` is the drive's own time; `progress` the share of
    its `goals` that were reached, the way to the next one included, of that time where there is
    none. `unreached` has the reason for each goal that was not. `shortcut_m` of the way to goals
    led through streets that the robot had not been in before it had any.

    `estimate` has the errors of the estimated position, `wheels_alone` and `fused_alone` those of
    path integration alone: of the wheels' odometry, and of the self-motion that sensory memory
    fuses of wheels and views. `error_ratio` is the estimate's mean error over that of the wheels,
    `error_over_fused` over that of fused self-motion; None where these do not err, as of a robot
    that never moved. `cycle_*_ms`: camera frame stamped to motor
    command received; `bus_share`: the part of the mean spent in anything but computing. `halted`
    and `slowed` count the commands that stopped the robot or kept it below cruising, by reason.
    `dropped` answers of codelets are in no delta; `refused` gives the reasons of the last few.
    `forgotten` are the objects that left the map, having been seen too seldom. `gaps`: messages
    lost for good, by NEVER_DROP topic. `energy` is None where the robot's battery does not run
    down. `recalled` is the map of an earlier run that the agent has recalled, empty where it has
    none, and `recalled_m` the distance that it had driven by then. `buildings` is None where the
    true buildings are not known. `recording` is what was played, empty where the drive was
    simulated: `views` of it, and `skipped`, which could not be read; `skipped_reasons` say why the
    last few could not, and what else is not played.
    """

    drive_s: float
    distance_m: float
    progress: float
    goals: int
    goals_reached: int
    unreached: dict[str, str]
    shortcut_m: float
    estimate: ErrorMetrics
    wheels_alone: ErrorMetrics
    fused_alone: ErrorMetrics
    error_ratio: float | None
    error_over_fused: float | None
    estimates: int
    commands: int
    broadcasts: int
    halted: dict[str, int]
    slowed: dict[str, int]
    cycle_p50_ms: float
    cycle_p99_ms: float
    bus_share: float
    objects: int
    forgotten: list[str]
    road_m2: float
    deltas: int
    dropped: int
    refused: list[str]
    gaps: dict[str, int]
    gaps_total: int
    rejected: dict[str, int]
    superseded: dict[str, int]
    busy: dict[str, float]
    memory_mb: dict[str, float]
    energy: EnergyMetrics | None = None
    recalled: str = ""
    recalled_m: float | None = None
    buildings: BuildingMetrics | None = None
    recording: str = ""
    views: int = 0
    skipped: int = 0
    skipped_reasons: list[str] = []


class RecordedMetrics(DriveMetrics, kw_only=True):
    """What the log of a drive shows: its drive, its settings, and the recording; None where there
    is none, or it was not finished. `town` is that of the settings, by its name or its file.
    """

    completed: bool
    town: str
    seed: int
    lockstep: bool
    log: Recording | None


class RunMetrics(RecordedMetrics, kw_only=True):
    """What one run showed: its drive, and its processes.

    `ended_by` is how it ended in two words, `reason` in a sentence. `wall_s` is how long the
    command took and `start_s` when, after it began, each milestone was reached. `restarts` and
    `killed` name processes. `rules_*` are the settings of `--rules`, as they were in effect.
    """

    ended_by: str
    reason: str
    codelets: int
    wall_s: float
    start_s: dict[str, float]
    restarts: dict[str, int]
    killed: list[str]
    rules_localization: str = ""
    rules_closes_by: str = ""
    rules_correct: str = ""
    rules_planning: str = ""


def objects(graph: Graph) -> list[Object]:
    """Return the objects of the map, by id."""
    return list(graph.of_kind(Object))


def position_m(node: Object) -> tuple[float, float]:
    """Return the position of an object in the agent's frame."""
    return node.x_m, node.y_m


def judged(tally: Tally) -> Judgement | None:
    """Judge the buildings on the map by the true ones; None if these are not known."""
    observer = tally.observer
    if observer.town is None or not observer.town.buildings:
        return None
    return judge(tally.percepts, observer.town, tally.replica.graph, observer.to_world)


def headline(metrics: DriveMetrics) -> str:
    """Tell how many buildings stand on the map for how many that were seen, how many of them are
    right, and how far they err.
    """
    found = metrics.buildings
    if found is None:
        return f"{metrics.objects} on the map; the true ones are not known"
    if not found.seen:
        return f"{metrics.objects} on the map; none was seen in {SEEN_VIEWS} views"

    told = f"{found.on_map} on the map for {found.seen} seen in {SEEN_VIEWS} views or more"
    if found.error_median_m is None:
        return told
    return (
        f"{told}; {found.right} of them right within {RIGHT_M:g} m, "
        f"{found.error_median_m:.2f} m off in the median"
    )


def road_m2(graph: Graph) -> float:
    """Compute the area of the place nodes that are taken for road."""
    _, road = graph.places.written_cells(ROOT_MAP, PlaceColumn.ROAD)
    is_road = road > ROAD_THRESHOLD
    area_m2 = graph.cell_m() ** 2
    return int(is_road.sum()) * area_m2


def _length_m(steps_m: Floats) -> float:
    """Compute the length of (n, 2, 2) steps."""
    return float(np.hypot(*(steps_m[:, 1] - steps_m[:, 0]).T).sum())


def drive_metrics(tally: Tally, gaps: dict[str, int], rejected: dict[str, int]) -> DriveMetrics:
    """Compute the metrics of a drive, with the messages that were lost and rejected, by topic. A
    mean and a percentile of nothing are 0.
    """
    observer = tally.observer
    graph = tally.replica.graph
    errors = observer.errors()
    judgement = judged(tally)
    cycle_ms = tally.cycle_ms or [0.0]
    health = sorted(tally.health.items())

    return DriveMetrics(
        drive_s=observer.elapsed_s,
        distance_m=observer.travelled_m,
        progress=observer.progress,
        goals=observer.goals,
        goals_reached=observer.goals_reached,
        unreached=unreached(graph),
        shortcut_m=_length_m(observer.shortcuts_m),
        estimate=ErrorMetrics.of(errors.estimate_m),
        wheels_alone=ErrorMetrics.of(errors.wheels_m),
        fused_alone=ErrorMetrics.of(errors.fused_m),
        error_ratio=errors.over_wheels,
        error_over_fused=errors.over_fused,
        estimates=int(errors.stamps_ns.size),
        commands=len(tally.cycle_ms),
        broadcasts=tally.broadcasts,
        halted=dict(tally.halted),
        slowed=dict(tally.slowed),
        cycle_p50_ms=float(np.percentile(cycle_ms, 50)),
        cycle_p99_ms=float(np.percentile(cycle_ms, 99)),
        bus_share=sum(tally.bus_ms) / max(1e-9, sum(cycle_ms)),
        objects=len(objects(graph)),
        forgotten=list(tally.forgotten),
        road_m2=road_m2(graph),
        deltas=graph.version,
        dropped=tally.dropped,
        refused=list(tally.refused),
        gaps=gaps,
        gaps_total=sum(gaps.values()),
        rejected=rejected,
        superseded={name: sum(each.superseded.values()) for name, each in health},
        busy=tally.busy,
        memory_mb={name: each.memory_mb for name, each in health},
        energy=tally.energy.metrics(),
        recalled=tally.observer.recalled,
        recalled_m=tally.observer.recalled_m,
        buildings=None if judgement is None else judgement.metrics(),
        recording=observer.played.recording,
        views=observer.played.views,
        skipped=observer.played.skipped,
        skipped_reasons=list(observer.played.reasons),
    )
