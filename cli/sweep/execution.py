"""Runs a sweep from its plan to its result."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cogmap.cli.progress import bar
from cogmap.cli.run.script import DriveOptions, summary_in
from cogmap.cli.sweep.plan import PlannedDrive, Settings, left_to_drive, plan
from cogmap.cli.sweep.result import Sweep, SweptDrive
from cogmap.cli.sweep.running import run_all

STEPPED_LIMIT_S = 3600.0
"""The wall-clock time that a drive in lockstep may take: a busy machine must not change its end.
Simulated time is limited anyway, and what stands still is ended before.
"""


def drive_all(
    folder: Path,
    seeds: Sequence[int],
    variants: Sequence[Settings],
    common: Settings,
    processes: int,
    options: DriveOptions,
) -> Sweep:
    """Drive with each variant of the settings and each seed what is not in `folder` yet, in
    lockstep unless `options` say otherwise. Raises as `plan` and `left_to_drive` do.
    """
    chosen: DriveOptions = {"lockstep": True, **options}
    if chosen["lockstep"]:
        chosen.setdefault("time_limit_s", STEPPED_LIMIT_S)
    drives = plan(folder, seeds, variants, common, chosen)
    left = left_to_drive(folder, drives)
    with bar(f"{len(left)} of {len(drives)} drives") as progress:
        errors = run_all(left, processes, progress)
    return Sweep(folder, [_swept(drive, errors.get(drive.folder, "")) for drive in drives])


def _swept(drive: PlannedDrive, error: str) -> SweptDrive:
    """Return what a drive left; `error` says why it left nothing."""
    summary = summary_in(drive.folder)
    if summary is not None and not summary.completed:
        error = summary.reason
        if not error.startswith(summary.ended_by):
            error = f"{summary.ended_by}: {error}"
    return SweptDrive(drive.seed, drive.settings, drive.folder, summary, error)
