"""Summarises a run: its metrics and its map as files, and a table on the screen."""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import msgspec
from rich.markup import escape
from rich.table import Table

from cogmap.cli.launch.drive import Drive
from cogmap.cli.launch.drive_metrics import (
    DriveMetrics,
    ErrorMetrics,
    RecordedMetrics,
    Recording,
    RunMetrics,
    drive_metrics,
    headline,
)
from cogmap.cli.launch.outcome import Ending, Outcome
from cogmap.cli.launch.watch import Watch
from cogmap.cli.launch.watchdog import MAX_SHARE_SLOWED, REMEDY
from cogmap.cli.run.folder import SUMMARY_NAME
from cogmap.recording.completeness import logs_of
from cogmap.schemas.sensing import SpeedLimit
from cogmap.services.codelets.rules import rules_of
from cogmap.services.motor.config import Config as MotorConfig

MAP_NAME = "map.png"
NAMED = 8


def finish(drive: Drive, watch: Watch, ending: Ending) -> RunMetrics:
    """Write the summary and the map of a drive that has ended so."""
    of_drive = drive_metrics(watch.tally, watch.gaps(), watch.rejected())
    log = None
    if drive.choices.record:
        log = Recording.of_run(logs_of(drive.folder), drive.published)
    rules = rules_of(drive.sections)
    metrics = RunMetrics(
        **msgspec.structs.asdict(of_drive),
        completed=ending.outcome in {Outcome.ROUTE_COMPLETE, Outcome.RECORDING_OVER},
        ended_by=ending.outcome.value,
        reason=ending.reason,
        town=drive.sections["sim"]["town"],
        seed=drive.sections["sim"]["seed"],
        lockstep=drive.sections["run"]["lockstep"],
        codelets=drive.choices.codelets,
        wall_s=time.monotonic() - drive.began_s,
        start_s=drive.start_s,
        restarts=dict(drive.supervisor.restarts),
        killed=drive.supervisor.killed,
        log=log,
        rules_localization=rules["localization"],
        rules_closes_by=rules["closes_by"],
        rules_correct=rules["correct"],
        rules_planning=rules["planning"],
    )
    indented = msgspec.json.format(msgspec.json.encode(metrics))
    (drive.folder / SUMMARY_NAME).write_bytes(indented + b"\n")

    from cogmap.cli.plots.map.picture import (
        draw,
    )  # half a second, which the start of a run is spared

    logging.getLogger("matplotlib").setLevel(logging.WARNING)
    draw(drive.folder / MAP_NAME, watch.tally, metrics)
    return metrics


def table(metrics: RunMetrics, folder: Path) -> Table:
    """Tabulate the metrics that matter most."""
    reason = metrics.reason
    if not reason.startswith(metrics.ended_by):
        reason = f"{metrics.ended_by}: {reason}"

    restarts = ", ".join(f"{name} {number}" for name, number in metrics.restarts.items())
    rows = [*drive_rows(metrics), *_loss_rows(metrics, "not recorded")]
    rows.append(("restarts", restarts or "none"))
    return _table(f"{reason}\n{folder}", rows)


def recorded_table(metrics: RecordedMetrics, log: Path) -> Table:
    """Tabulate the metrics that matter most, of a log."""
    rows = [*drive_rows(metrics), *_loss_rows(metrics, "the recording was not finished")]
    return _table(str(log), rows)


def _table(title: str, rows: list[tuple[str, str]]) -> Table:
    shown = Table(show_header=False, title=title, title_justify="left")
    for name, value in rows:
        shown.add_row(name, value)
    return shown


def drive_rows(metrics: DriveMetrics) -> list[tuple[str, str]]:
    """Make the rows of the table about the drive."""
    driven = f"{metrics.distance_m:.1f} m in {metrics.drive_s:.1f} s"
    if metrics.goals:
        driven = f"{driven}, {metrics.goals_reached} of {metrics.goals} goals reached"
    if metrics.shortcut_m:
        driven = f"{driven}, {metrics.shortcut_m:.0f} m of the way through streets new to it"
    rows = [("driven", driven)]
    if metrics.recording:
        rows.append(("recording", _played(metrics)))

    if metrics.unreached:
        sentences = [escape(f"{name}: {reason}") for name, reason in metrics.unreached.items()]
        rows.append(("not reached", _first(sentences, "\n")))

    over = {"fused self-motion": metrics.error_over_fused, "wheels": metrics.error_ratio}
    ratios = [f"{ratio:.3f} over {name}" for name, ratio in over.items() if ratio is not None]
    limits = Counter(metrics.halted) + Counter(metrics.slowed)
    shares = [f"{name} {number / metrics.commands:.0%}" for name, number in limits.most_common()]
    rows += [
        ("position error", _errors(metrics.estimate)),
        ("path integration alone, fused self-motion", _errors(metrics.fused_alone)),
        ("path integration alone, wheels", _errors(metrics.wheels_alone)),
        ("error ratio", ", ".join(ratios) or "not measured"),
        ("buildings", headline(metrics)),
        ("learned", f"{metrics.road_m2:.0f} m² of street"),
        ("forgotten", _first(metrics.forgotten, ", ") or "nothing"),
        ("cycle", f"{metrics.cycle_p50_ms:.0f} ms, 99 % within {metrics.cycle_p99_ms:.0f} ms"),
        ("slowed or halted", ", ".join(shares) or "never"),
        *_machine_rows(metrics, limits[SpeedLimit.POSE_AGE.value]),
    ]
    if metrics.recalled_m is not None:
        rows.append(("recalled", f"{metrics.recalled}, after {metrics.recalled_m:.1f} m"))
    if metrics.energy is not None:
        energy = metrics.energy
        levels = f"at least {energy.lowest:.0%}, {energy.final:.0%} at the end"
        shown = "ran out" if energy.ran_out else levels
        rows.append(("energy", f"{shown}; charged {energy.charged} times"))
    return rows


def _machine_rows(metrics: DriveMetrics, limited: int) -> list[tuple[str, str]]:
    """Make the row that names a machine on which the age of the poses has limited too many
    commands.
    """
    if limited <= MAX_SHARE_SLOWED * metrics.commands:
        return []

    motor = MotorConfig()
    needed_ms = 1000 * motor.blind_m / motor.cruise_m_s
    slow = (
        f"too slow for real time: a cycle takes {metrics.cycle_p50_ms:.0f} ms, and the robot "
        f"cruises where it takes {needed_ms:.0f} ms: {REMEDY}"
    )
    return [("machine", slow)]


def _played(metrics: DriveMetrics) -> str:
    """Write what was played, and what of it was left out."""
    played = f"{metrics.recording}, {metrics.views} views"
    if SpeedLimit.RECORDING in metrics.halted:
        played = f"{played}; commands moved nothing in it"
    if metrics.skipped:
        played = f"{played}; {metrics.skipped} left out"
    return "\n".join([played, *map(escape, metrics.skipped_reasons)])


def _first(words: Sequence[str], separator: str) -> str:
    """Join the first few of `words`, and the number of the others."""
    shown = list(words[:NAMED])
    if len(words) > NAMED:
        shown.append(f"and {len(words) - NAMED} more")
    return separator.join(shown)


def _errors(errors: ErrorMetrics) -> str:
    if not errors.is_measured:
        return "not measured"
    return f"{errors.mean_m:.2f} m on average, at most {errors.max_m:.2f} m"


def _loss_rows(metrics: RecordedMetrics, without_log: str) -> list[tuple[str, str]]:
    """Make the rows about messages that were lost, by the counts of the modules and of the
    recorder, and about answers that were dropped.
    """
    log = metrics.log
    lost = f"{metrics.gaps_total}; {without_log}"
    if log is not None:
        gaps = "no gap in any NEVER_DROP topic" if log.never_drop_whole else "; ".join(log.gaps)
        recorded = f"{log.messages} messages, {log.size_mb:.0f} MB"
        logs = "in the log" if log.logs == 1 else f"in the {log.logs} logs"
        lost = f"{metrics.gaps_total}; {logs}, {recorded}: {gaps}"

    dropped = "none"
    if metrics.refused:
        dropped = f"{metrics.dropped}, the last: {metrics.refused[-1]}"
    return [("lost messages", lost), ("dropped answers", dropped)]
