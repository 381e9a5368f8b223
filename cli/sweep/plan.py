"""Plans a sweep: which drives it has, and which of them have been driven before."""

from __future__ import annotations

import hashlib
import itertools
import json
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from cogmap.cli.launch.outcome import Outcome
from cogmap.cli.run.script import DriveOptions, RunOptions, option_words, settings_of, summary_in
from cogmap.errors import StorageError, UsageError
from cogmap.version import VERSION

PLAN_NAME = "sweep.json"
MAX_NAME = 120
OWN = RunOptions.__annotations__.keys() - DriveOptions.__annotations__.keys()
"""The options of a drive that a sweep does not take: it chooses some for each drive, a recording
leaves no choice of a seed, and a memory would let one drive depend on another.
"""
Settings = Mapping[str, object]


@dataclass(frozen=True)
class PlannedDrive:
    """One drive of a sweep: its `seed`, the `settings` that vary, by module.key, and its files in
    `folder`. `options` are all that `cogmap.run` needs, but for the endpoint.
    """

    seed: int
    settings: Settings
    folder: Path
    options: RunOptions

    @property
    def request(self) -> dict[str, Any]:
        """Return what was asked for, as JSON has it: a drive of the same request gives the same."""
        asked = {
            "version": VERSION,
            "options": option_words(self.options),
            "settings": settings_of(self.options),
        }
        read: dict[str, Any] = json.loads(json.dumps(asked, default=str))
        return read


def plan(
    folder: Path,
    seeds: Sequence[int],
    variants: Sequence[Settings],
    common: Settings,
    options: DriveOptions,
) -> list[PlannedDrive]:
    """Plan a drive for each variant of the settings and each seed, in that order, with its files in
    a folder of `folder`; `common` are settings of all.

    Raises UsageError if there is none, for one that is there twice, and for an option that a sweep
    does not take.
    """
    refused = sorted(OWN & options.keys())
    if refused:
        raise UsageError(f"a sweep takes no {' and no '.join(refused)}: leave it out")

    drives: dict[Path, PlannedDrive] = {}
    for variant, seed in itertools.product(variants, seeds):
        place = folder / _name(variant, seed)
        if place in drives:
            raise UsageError(f"{place.name} is there twice: name each seed and variant once")
        settings = {**common, **variant}
        own = {**options, "seed": seed, "settings": settings, "out": place}
        drives[place] = PlannedDrive(seed, variant, place, cast(RunOptions, own))
    if not drives:
        raise UsageError("a sweep needs a seed, and a variant of the settings")
    return list(drives.values())


def left_to_drive(folder: Path, drives: Sequence[PlannedDrive]) -> list[PlannedDrive]:
    """Return the drives that have no summary in `folder` yet, whose plan is written there.

    What an interrupted one left is removed. Raises UsageError if a drive of other options is there
    in the place of one, and StorageError if the folder cannot be written.
    """
    requests = {drive.folder.name: drive.request for drive in drives}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        known = _known(folder / PLAN_NAME)
        for drive in drives:
            name = drive.folder.name
            if drive.folder.exists() and known.get(name) != requests[name]:
                raise UsageError(
                    f"{drive.folder} has a drive of other options or of another version: name "
                    "another folder with --out"
                )

        left = [drive for drive in drives if not _is_driven(drive)]
        for drive in left:
            if drive.folder.exists():
                shutil.rmtree(drive.folder)
        text = json.dumps(known | requests, indent=2)
        (folder / PLAN_NAME).write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise StorageError(
            f"cannot write {error.filename or folder} ({error.strerror}): name another folder with "
            "--out"
        ) from None
    return left


def label(settings: Settings) -> str:
    """Write the settings of a variant in a line; empty where it has none."""
    return ", ".join(f"{key}={value}" for key, value in settings.items())


def _name(settings: Settings, seed: int) -> str:
    """Return the name of a drive's folder."""
    if not settings:
        return f"seed-{seed}"
    safe = re.sub(r"[^\w.=+-]+", "_", label(settings))
    if len(safe) > MAX_NAME:
        digest = hashlib.sha256(safe.encode()).hexdigest()
        safe = f"{safe[:MAX_NAME]}-{digest[:8]}"
    return f"{safe}-seed-{seed}"


def _known(path: Path) -> dict[str, Any]:
    """Return the requests of the drives that were planned before, by name. Raises UsageError."""
    if not path.exists():
        return {}
    try:
        known = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        known = None
    if not isinstance(known, dict):
        raise UsageError(f"{path} is no plan of a sweep: name another folder with --out")
    return known


def _is_driven(drive: PlannedDrive) -> bool:
    """Decide whether a drive has a summary, of its end rather than of a Ctrl-C."""
    summary = summary_in(drive.folder)
    return summary is not None and summary.ended_by != Outcome.INTERRUPTED.value
