"""What a run leaves: a summary, a map, and a table on the screen."""

from __future__ import annotations

import importlib
import logging
import time
from pathlib import Path

import msgspec
from rich.table import Table

from cli.launch.drive import ROUTE_COMPLETE, Drive
from cli.launch.metrics import Figures, Recording, measured
from cli.launch.plan import LOG_NAME
from cli.launch.watch import Watch


def finish(drive: Drive, watch: Watch) -> Figures:
    """Write the summary and the map."""
    sim = drive.sections["sim"]
    errors = watch.observer.errors()
    figures = Figures(
        completed=drive.ended_by == ROUTE_COMPLETE,
        ended_by=drive.ended_by,
        seed=sim["seed"],
        laps=sim["laps"],
        mode=sim["mode"],
        codelets=drive.choices.codelets,
        wall_s=time.monotonic() - drive.began_s,
        start_s=drive.start_s,
        restarts=dict(drive.supervisor.restarts),
        killed=drive.supervisor.killed,
        log=Recording.read(drive.folder / LOG_NAME) if drive.choices.record else None,
        **measured(watch, errors),
    )
    (drive.folder / "summary.json").write_bytes(
        msgspec.json.format(msgspec.json.encode(figures)) + b"\n"
    )
    logging.getLogger("matplotlib").setLevel(logging.WARNING)
    picture = importlib.import_module(
        "cli.plots.map"
    )  # half a second, which the start of a run has no use for
    picture.draw(drive.folder / "map.png", watch.observer, watch.replica.graph, figures)
    return figures


def table(figures: Figures, folder: Path) -> Table:
    """The figures that matter most."""
    shown = Table(show_header=False, title=f"{figures.ended_by} · {folder}", title_justify="left")
    estimate = figures.estimate
    alone = figures.path_integration
    rows = {
        "driven": f"{figures.distance_m:.1f} m in {figures.drive_s:.1f} s, {figures.progress:.0%} of the route",
        "position error": f"{estimate.mean_m:.2f} m on average, at most {estimate.max_m:.2f} m",
        "path integration alone": f"{alone.mean_m:.2f} m on average, at most {alone.max_m:.2f} m",
        "error ratio": f"{figures.error_ratio:.3f}",
        "learned": f"{figures.objects} buildings, half of them within {figures.object_error_median_m:.2f} m; "
        f"{figures.road_m2:.0f} m² of street",
        "cycle": f"{figures.cycle_p50_ms:.0f} ms, 99 % within {figures.cycle_p99_ms:.0f} ms",
        "lost messages": _losses(figures),
        "dropped answers": f"{figures.dropped}, the last: {figures.refused[-1]}"
        if figures.refused
        else "none",
        "restarts": ", ".join(f"{name} {number}" for name, number in figures.restarts.items())
        or "none",
    }
    for name, value in rows.items():
        shown.add_row(name, value)
    return shown


def _losses(figures: Figures) -> str:
    """What was lost, as the modules and the recorder counted it."""
    if figures.log is None:
        return f"{figures.gaps_total}; not recorded"
    recorded = (
        "no gap in any NEVER_DROP topic"
        if figures.log.never_drop_whole
        else "; ".join(figures.log.gaps)
    )
    return f"{figures.gaps_total}; in the log, {figures.log.messages} messages, {figures.log.size_mb:.0f} MB: {recorded}"
