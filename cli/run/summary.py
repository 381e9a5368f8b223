"""What a run leaves: a summary, a map, and a table on the screen."""

from __future__ import annotations

import logging
import time
from collections import Counter
from pathlib import Path

import msgspec
from rich.markup import escape
from rich.table import Table

from cogmap.cli.files import LOG_NAME
from cogmap.cli.launch.drive import Drive
from cogmap.cli.launch.drive_metrics import (
    DriveMetrics,
    ErrorMetrics,
    RecordedMetrics,
    Recording,
    RunMetrics,
    drive_metrics,
)
from cogmap.cli.launch.outcome import Ending, Outcome
from cogmap.cli.launch.tally import EnergyMetrics
from cogmap.cli.launch.watch import Watch

SUMMARY_NAME = "summary.json"
MAP_NAME = "map.png"
NAMED = 8


def finish(drive: Drive, watch: Watch, ending: Ending) -> RunMetrics:
    """Write the summary and the map of a drive that has ended so."""
    metrics = _run_metrics(drive, watch, ending)
    encoded = msgspec.json.encode(metrics)
    indented = msgspec.json.format(encoded)

    summary_path = drive.folder / SUMMARY_NAME
    summary_path.write_bytes(indented + b"\n")
    _draw_map(drive.folder / MAP_NAME, watch, metrics)
    return metrics


def _run_metrics(drive: Drive, watch: Watch, ending: Ending) -> RunMetrics:
    of_drive = drive_metrics(watch.tally, watch.gaps(), watch.rejected())
    log = Recording.read(drive.folder / LOG_NAME) if drive.choices.record else None
    return RunMetrics(
        **msgspec.structs.asdict(of_drive),
        completed=ending.outcome is Outcome.ROUTE_COMPLETE,
        ended_by=ending.outcome.value,
        reason=ending.reason,
        seed=drive.sections["sim"]["seed"],
        lockstep=drive.sections["run"]["lockstep"],
        codelets=drive.choices.codelets,
        wall_s=time.monotonic() - drive.began_s,
        start_s=drive.start_s,
        restarts=dict(drive.supervisor.restarts),
        killed=drive.supervisor.killed,
        log=log,
    )


def _draw_map(path: Path, watch: Watch, metrics: RunMetrics) -> None:
    from cogmap.cli.plots import (
        map as plot,  # half a second, which the start of a run has no use for
    )

    logging.getLogger("matplotlib").setLevel(logging.WARNING)
    plot.draw(path, watch.tally.observer, watch.tally.replica.graph, metrics)


def table(metrics: RunMetrics, folder: Path) -> Table:
    """The metrics that matter most."""
    reason = metrics.reason
    if not reason.startswith(metrics.ended_by):
        reason = f"{metrics.ended_by}: {reason}"
    title = f"{reason}\n{folder}"
    rows = drive_rows(metrics)
    rows += _loss_rows(metrics, "not recorded")
    rows += _process_rows(metrics)
    return _table(title, rows)


def recorded_table(metrics: RecordedMetrics, log: Path) -> Table:
    """The metrics that matter most, of a log."""
    rows = drive_rows(metrics)
    rows += _loss_rows(metrics, "the recording was not finished")
    return _table(str(log), rows)


def _table(title: str, rows: list[tuple[str, str]]) -> Table:
    shown = Table(show_header=False, title=title, title_justify="left")
    for name, value in rows:
        shown.add_row(name, value)
    return shown


def drive_rows(metrics: DriveMetrics) -> list[tuple[str, str]]:
    """The rows of the table that tell of the drive."""
    driven = f"{metrics.distance_m:.1f} m in {metrics.drive_s:.1f} s"
    if metrics.goals:
        driven = f"{driven}, {metrics.goals_reached} of {metrics.goals} goals reached"
    if metrics.shortcut_m:
        driven = f"{driven}, {metrics.shortcut_m:.0f} m of the way through streets new to it"
    ratios = f"{metrics.error_over_fused:.3f} over fused self-motion"
    if metrics.wheels_alone.is_measured:
        ratios = f"{ratios}, {metrics.error_ratio:.3f} over wheels"
    learned = (
        f"{metrics.objects} buildings, half of those that it knew by name within "
        f"{metrics.object_error_median_m:.2f} m; {metrics.road_m2:.0f} m² of street"
    )
    cycle = f"{metrics.cycle_p50_ms:.0f} ms, 99 % within {metrics.cycle_p99_ms:.0f} ms"
    rows = [
        ("driven", driven),
        *_unreached_rows(metrics),
        ("position error", _errors(metrics.estimate)),
        ("path integration alone, fused self-motion", _errors(metrics.fused_alone)),
        ("path integration alone, wheels", _errors(metrics.wheels_alone)),
        ("error ratio", ratios),
        ("learned", learned),
        ("forgotten", _forgotten(metrics)),
        ("cycle", cycle),
        ("slowed or halted", _limits(metrics)),
    ]
    if metrics.recalled_m is not None:
        rows.append(("recalled", f"{metrics.recalled}, after {metrics.recalled_m:.1f} m"))
    if metrics.energy is not None:
        rows.append(("energy", _energy(metrics.energy)))
    return rows


def _unreached_rows(metrics: DriveMetrics) -> list[tuple[str, str]]:
    """Why the first goals that were not reached were not, and how many others were not."""
    sentences = [escape(f"{name}: {reason}") for name, reason in metrics.unreached.items()]
    if not sentences:
        return []

    others = len(sentences) - NAMED
    shown = sentences[:NAMED]
    if others > 0:
        shown.append(f"and {others} more")
    return [("not reached", "\n".join(shown))]


def _energy(energy: EnergyMetrics) -> str:
    """How the battery fared."""
    levels = f"at least {energy.lowest:.0%}, {energy.final:.0%} at the end"
    charged = f"charged {energy.charged} times"
    if energy.ran_out:
        return f"ran out; {charged}"
    return f"{levels}; {charged}"


def _forgotten(metrics: DriveMetrics) -> str:
    """The first objects that left the map, and how many others did."""
    names = metrics.forgotten
    if not names:
        return "nothing"

    others = len(names) - NAMED
    first = ", ".join(names[:NAMED])
    return f"{first} and {others} more" if others > 0 else first


def _limits(metrics: DriveMetrics) -> str:
    """What kept the robot below its cruising speed, by how many of the commands."""
    limits = Counter(metrics.halted) + Counter(metrics.slowed)
    shares = []
    for name, number in limits.most_common():
        share = number / metrics.commands
        shares.append(f"{name} {share:.0%}")

    if not shares:
        return "never"
    return ", ".join(shares)


def _errors(errors: ErrorMetrics) -> str:
    if not errors.is_measured:
        return "not measured"
    return f"{errors.mean_m:.2f} m on average, at most {errors.max_m:.2f} m"


def _loss_rows(metrics: RecordedMetrics, without_log: str) -> list[tuple[str, str]]:
    dropped = "none"
    if metrics.refused:
        last_reason = metrics.refused[-1]
        dropped = f"{metrics.dropped}, the last: {last_reason}"

    return [
        ("lost messages", _losses(metrics, without_log)),
        ("dropped answers", dropped),
    ]


def _process_rows(metrics: RunMetrics) -> list[tuple[str, str]]:
    restarts = []
    for name, number in metrics.restarts.items():
        restarts.append(f"{name} {number}")

    shown = ", ".join(restarts)
    return [("restarts", shown or "none")]


def _losses(metrics: RecordedMetrics, without_log: str) -> str:
    """What was lost, by the counts of the modules and of the recorder, which there may not be."""
    log = metrics.log
    if log is None:
        return f"{metrics.gaps_total}; {without_log}"

    gaps = "no gap in any NEVER_DROP topic" if log.never_drop_whole else "; ".join(log.gaps)
    return (
        f"{metrics.gaps_total}; in the log, {log.messages} messages, {log.size_mb:.0f} MB: {gaps}"
    )
