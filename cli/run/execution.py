"""Runs a drive once the options of `cogmap run` are read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import msgspec
from rich.console import Console

from cogmap.bus.access.subjects import DRIVE
from cogmap.bus.session import EXPOSED, check_free, is_exposed
from cogmap.cli import BEGAN_S
from cogmap.cli.launch.display import Display, display_on
from cogmap.cli.launch.drive import Drive
from cogmap.cli.launch.forking.client import ForkServer
from cogmap.cli.launch.plan import CONFIG_NAME, Choices, effective
from cogmap.cli.run import recordings, summary
from cogmap.cli.run.checks import check_inputs
from cogmap.cli.run.folder import new_folder
from cogmap.cli.run.options import AROUND_S, LAP_LIMIT_S
from cogmap.errors import StorageError
from cogmap.runtime import environment
from cogmap.runtime.config import Sections
from cogmap.runtime.process import Stop
from cogmap.services import registry
from cogmap.services.codelets.rules import described, rules_of
from cogmap.services.sim.layout.towns import LOOP, called


@dataclass(frozen=True)
class Start:
    """The options of `cogmap run`: `given` are the settings, `out` is the folder of its files, if
    None a new one in RUNS; `time_limit_s` is the default if it is None. It ends with standard input
    where it is `tied`.
    """

    choices: Choices
    given: Sections
    endpoint: str
    agent: str
    out: Path | None
    time_limit_s: float | None
    as_json: bool
    tied: bool = False


def run_drive(start: Start, server: ForkServer | None) -> int:
    """Drive, and print the summary. Returns the exit code; `server` forks the processes.

    Raises UsageError if it cannot be done so, and StorageError if a file cannot be written.
    """
    stop = Stop(start.tied)
    choices = recordings.chosen(start.choices, start.given)
    console = Console(stderr=start.as_json)
    given = start.given
    recording = recordings.opened(choices, given)
    if recording is not None:
        given = recordings.with_settings(given, recording)
    sections = effective(given, choices, observer=True)
    check_inputs(sections, choices)
    if recording is not None:
        default_s = recordings.limit_s(recording, sections)
    else:
        default_s = default_limit_s(sections["sim"], choices)
    if choices.own_router:
        check_free(start.endpoint)

    folder = new_folder(start.out)
    drive = Drive(
        folder,
        start.endpoint,
        start.agent,
        choices,
        sections,
        began_s=BEGAN_S,
        limit_s=start.time_limit_s or default_s,
        limits_start=start.time_limit_s is not None,
        server=server,
    )
    screen = display_on(console)
    _introduce(screen, drive)
    with _writing(folder):
        try:
            watch, ending = drive.run(stop, screen)
        finally:
            screen.close()
        metrics = summary.finish(drive, watch, ending)

    if start.as_json:
        click.echo(msgspec.json.encode(metrics))
    else:
        console.print(summary.table(metrics, folder))
    return ending.outcome.exit_code


def default_limit_s(sim: dict[str, Any], choices: Choices) -> float:
    """Return how long a drive with these settings of the simulation may take once it has begun.

    It grows with each lap, and is one lap's at least; without laps it is the drive's duration, and
    time to end.
    """
    has_laps = not (choices.tour or choices.goals or choices.explore_s)
    if sim["town"] == LOOP and has_laps:
        return LAP_LIMIT_S * max(1.0, choices.laps or 1.0)

    return float(sim["duration_s"]) + AROUND_S


def _introduce(screen: Display, drive: Drive) -> None:
    """Show the town or the recording, the folder and the goals, and what the user has to start."""
    sim = drive.sections["sim"]
    town = called(sim["town"], sim["seed"])
    screen.show(f"{drive.choices.recording or town}, files in {drive.folder}")
    screen.show(described(rules_of(drive.sections)))
    if drive.choices.own_router and environment.keys(DRIVE) is None and is_exposed(drive.endpoint):
        screen.show(EXPOSED)

    if drive.goals:
        order = "in order" if drive.sections["workspace"]["in_order"] else "in an order of its own"
        explore_s = drive.choices.explore_s
        if explore_s is not None:
            screen.show(f"the agent explores the town for {explore_s:g} s")
        screen.show(f"its goals, {order}: {drive.goals}")
    if drive.choices.without:
        modules = ", ".join(drive.choices.without)
        options = f"--connect {drive.endpoint} --config {drive.folder / CONFIG_NAME}"
        screen.show(f"start {modules} yourself with {options}")
    if registry.SIM in drive.choices.without:
        screen.show(f"or let a robot be sim: cogmap ros2 --connect {drive.endpoint}")


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Raise StorageError if a file of `folder` cannot be written."""
    try:
        yield
    except OSError as error:
        path = error.filename or folder
        raise StorageError(
            f"cannot write {path} ({error.strerror}): make room on its disk, "
            "or name another folder with --out"
        ) from error
