"""`cogmap run`: a drive around the simulated town, every module a process of its own."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import msgspec
from rich.console import Console

from cli.goal import read_goals
from cli.launch.drive import Drive
from cli.launch.plan import CONFIG_NAME, Choices, awaited, effective
from cli.options import FiniteRange, agent_option, config_option, connect_option, set_option
from cli.run import summary
from cli.run.checks import check_inputs
from cli.run.display import Display, display_on
from cogmap.bus.session import check_free
from cogmap.errors import ConfigError, StorageError
from cogmap.runtime import config
from cogmap.runtime.process import Stop
from services import registry
from services.sim.layout import towns
from services.sim.layout.towns import BLOCKS, LOOP, OSM

RUNS = Path("runs")
LAP_LIMIT_S = 85.0
AROUND_S = 30.0
FINISH_S = 4.0

seed_option = click.option(
    "--seed", type=click.IntRange(0, 2**32), help="Which town, and which noise.  [default: 1]"
)


def _known_town(context: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Refuse a town that there is none of. Raises ConfigError."""
    if value is not None:
        towns.check(value)
    return value


town_option = click.option(
    "--town",
    metavar="TOWN",
    callback=_known_town,
    help="loop, blocks, or osm:FILE, the extract of OpenStreetMap in FILE.  [default: loop]",
)
tour_option = click.option(
    "--tour",
    is_flag=True,
    help="In a town of blocks: explore, plan the order of three goals, find round a closed street.",
)
goals_option = click.option(
    "--goals",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Drive to the goals in FILE, one a line: a name, or x and y; end at the last.",
)
explore_option = click.option(
    "--explore",
    "explore_s",
    type=FiniteRange(1, 1e5),
    metavar="SECONDS",
    help="Explore for so long, then drive to the goals, or home to where it started.",
)
energy_option = click.option(
    "--energy",
    is_flag=True,
    help="The robot's battery runs down, and is charged at charging places in the town.",
)
laps_option = click.option(
    "--laps",
    type=FiniteRange(0, 1000, min_open=True),
    help="Goals in the loop of streets: its corners, in order, so many times round.  [default: 1]",
)
codelets_option = click.option(
    "--codelets", type=click.IntRange(1, 64), default=1, show_default=True, help="How many workers."
)
lockstep_option = click.option(
    "--lockstep/--real-time",
    help="Wait for every answer, the same bytes each time; or drive as time passes.  "
    "[default: real time]",
)


@click.command()
@seed_option
@town_option
@tour_option
@explore_option
@goals_option
@laps_option
@energy_option
@lockstep_option
@codelets_option
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="A new folder for its files.  [default: runs/TIME]",
)
@click.option(
    "--memory",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Remember earlier runs, and this one, in the database FILE.  [default: this run alone]",
)
@click.option(
    "--record/--no-record", default=True, help="Whether to keep a log of all that travels."
)
@click.option(
    "--time-limit",
    type=FiniteRange(5, 1e6),
    metavar="SECONDS",
    help=f"End after so long, start and end included.  [default: {LAP_LIMIT_S:g} for each lap]",
)
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
@click.option(
    "--router",
    metavar="ENDPOINT",
    help="Use the router that listens there, such as zenohd, and start none.",
)
@click.option(
    "--without",
    multiple=True,
    type=click.Choice([*registry.MODULES, "all"]),
    metavar="MODULE",
    help="Start all modules but this, and wait for yours; repeat at will, or `all`.",
)
@connect_option
@agent_option
@config_option
@set_option
def run(
    seed: int | None,
    town: str | None,
    tour: bool,
    explore_s: float | None,
    goals: Path | None,
    laps: float | None,
    energy: bool,
    lockstep: bool,
    codelets: int,
    out: Path | None,
    memory: Path | None,
    record: bool,
    time_limit: float | None,
    as_json: bool,
    router: str | None,
    without: tuple[str, ...],
    connect: str,
    agent: str,
    config_path: Path | None,
    settings: tuple[str, ...],
) -> None:
    """Drive the robot through a simulated town: to goals, by routes of its own, or exploring.

    Starts a router and every module as a process of its own, shows how the drive proceeds, and
    leaves a folder with the log, a map and a summary, which runs/latest links to. Ends with 0
    where every goal was reached, 130 after Ctrl-C, else with 1; the summary gives the reason.
    """
    began_s = time.monotonic()
    stop = Stop()
    console = Console(stderr=as_json)
    choices = Choices(
        seed=seed,
        town=town,
        laps=laps,
        lockstep=lockstep,
        codelets=codelets,
        record=record,
        without=registry.MODULES if "all" in without else without,
        own_router=router is None,
        tour=tour,
        explore_s=explore_s,
        goals=() if goals is None else read_goals(goals),
        memory=None if memory is None else memory.resolve(),
        energy=energy,
    )
    sections = effective(
        config.load(config_path, settings), choices, awaited(choices, observer=True)
    )
    check_inputs(sections, choices)
    if router is None:
        check_free(connect)

    endpoint = router or connect
    drive = Drive(_new_folder(out), endpoint, agent, choices, sections, began_s)
    limit_s = time_limit or default_limit_s(sections["sim"], choices)
    screen = display_on(console)
    _introduce(screen, drive)
    with _writing(drive.folder):
        try:
            watch, ending = drive.run(began_s + limit_s - FINISH_S, stop, screen)
        finally:
            screen.close()
        metrics = summary.finish(drive, watch, ending)

    if as_json:
        click.echo(msgspec.json.encode(metrics))
    else:
        console.print(summary.table(metrics, drive.folder))
    sys.exit(ending.outcome.exit_code)


def default_limit_s(sim: dict[str, Any], choices: Choices) -> float:
    """The time limit of a drive with these settings of the simulation.

    It grows with each lap, and is one lap's at least; without laps it is the drive's duration, and
    time to start and to end.
    """
    has_laps = not (choices.tour or choices.goals or choices.explore_s)
    if sim["town"] == LOOP and has_laps:
        return LAP_LIMIT_S * max(1.0, choices.laps or 1.0)

    return float(sim["duration_s"]) + AROUND_S


def _introduce(screen: Display, drive: Drive) -> None:
    screen.show(f"{_town(drive)}, files in {drive.folder}")
    if drive.goals:
        order = "in order" if drive.sections["workspace"]["in_order"] else "in an order of its own"
        explore_s = drive.choices.explore_s
        if explore_s is not None:
            screen.show(f"the agent explores the town for {explore_s:g} s")
        screen.show(f"its goals, {order}: {drive.goals}")
    if not drive.choices.without:
        return

    names = ", ".join(drive.choices.without)
    config_path = drive.folder / CONFIG_NAME
    screen.show(f"start {names} yourself with --connect {drive.endpoint} --config {config_path}")


def _town(drive: Drive) -> str:
    """The town of a drive, in words."""
    sim = drive.sections["sim"]
    if sim["town"] == LOOP:
        return f"town {sim['seed']}"
    if sim["town"] == BLOCKS:
        return f"town {sim['seed']} of blocks"

    return f"the town in {sim['town'].removeprefix(OSM)}"


def _new_folder(out: Path | None) -> Path:
    """`out`, or a folder of RUNS named after the time, which RUNS/latest then links to. Raises
    ConfigError where it exists or cannot be made.
    """
    folder = out or RUNS / time.strftime("%Y-%m-%d-%H%M%S")
    try:
        folder.mkdir(parents=True)
        if out is None:
            _link_latest(folder)
    except FileExistsError:
        raise ConfigError(f"{folder} exists already: name another with --out") from None
    except OSError as error:
        raise ConfigError(
            f"cannot make the folder {folder} ({error.strerror}): name another with --out"
        ) from None
    return folder


def _link_latest(folder: Path) -> None:
    """Let the link `latest` beside `folder` lead to it, at no moment nowhere."""
    latest = folder.with_name("latest")
    new = folder.with_name(f".latest-{folder.name}")
    new.symlink_to(folder.name)
    new.replace(latest)


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Raise StorageError where a file of `folder` cannot be written."""
    try:
        yield
    except OSError as error:
        path = error.filename or folder
        raise StorageError(
            f"cannot write {path} ({error.strerror}): make room on its disk, "
            "or name another folder with --out"
        ) from error
