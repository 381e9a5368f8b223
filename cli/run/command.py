"""`cogmap run`: a drive around the simulated town, every module a process of its own."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import click
import msgspec
from rich.console import Console

from cli.launch.drive import INTERRUPTED, Drive
from cli.launch.plan import Choices, effective, everybody
from cli.options import agent_option, config_option, connect_option, set_option
from cli.run import display, summary
from cogmap.bus.session import check_free
from cogmap.errors import ConfigError
from cogmap.runtime import config
from cogmap.runtime.process import Stop

FINISH_S = 4.0

seed_option = click.option(
    "--seed", type=click.IntRange(0, 2**32), help="Which town, and which noise.  [default: 1]"
)
laps_option = click.option(
    "--laps", type=click.FloatRange(0, 1000, min_open=True), help="How far.  [default: 1]"
)
codelets_option = click.option(
    "--codelets", type=click.IntRange(1, 64), default=1, show_default=True, help="How many workers."
)
lockstep_option = click.option(
    "--lockstep/--real-time",
    help="Wait for every answer, the same bytes each time; or drive as time passes.  [default: real time]",
)


@click.command()
@seed_option
@laps_option
@lockstep_option
@codelets_option
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="A new folder for its files.  [default: runs/TIME]",
)
@click.option(
    "--record/--no-record", default=True, help="Whether to keep a log of all that travels."
)
@click.option(
    "--time-limit",
    type=click.FloatRange(5, None),
    default=85.0,
    show_default=True,
    metavar="SECONDS",
    help="End after so long, all told.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
@connect_option
@agent_option
@config_option
@set_option
def run(
    seed: int | None,
    laps: float | None,
    lockstep: bool,
    codelets: int,
    out: Path | None,
    record: bool,
    time_limit: float,
    as_json: bool,
    connect: str,
    agent: str,
    config_path: Path | None,
    settings: tuple[str, ...],
) -> None:
    """Drive the robot around a loop of streets in a simulated town.

    Starts a router and every module as a process of its own, shows how the drive goes, and leaves a
    folder with the log, a map and a summary. Ends with 0 where the route was completed, 130 after
    Ctrl-C, else with 1.
    """
    began_s = time.monotonic()
    stop = Stop()
    console = Console(stderr=as_json)
    choices = Choices(seed=seed, laps=laps, lockstep=lockstep, codelets=codelets, record=record)
    sections = effective(
        config.load(config_path, settings), choices, everybody(choices, observer=True)
    )
    check_free(connect)
    drive = Drive(_new_folder(out), connect, agent, choices, sections, began_s)
    screen = display.on(console)
    screen.say(f"town {sections['sim']['seed']}, files in {drive.folder}")
    try:
        watch = drive.run(began_s + time_limit - FINISH_S, stop, screen)
    finally:
        screen.close()
    figures = summary.finish(drive, watch)
    if as_json:
        click.echo(msgspec.json.encode(figures))
    else:
        console.print(summary.table(figures, drive.folder))
    sys.exit(0 if figures.completed else 130 if figures.ended_by == INTERRUPTED else 1)


def _new_folder(out: Path | None) -> Path:
    """`out`, or a folder named after the time. Raises ConfigError where it exists or cannot be
    made.
    """
    name = time.strftime("%Y-%m-%d-%H%M%S")
    folder = out if out is not None else Path("runs") / name
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise ConfigError(f"{folder} exists already: name another with --out") from None
    except OSError as error:
        raise ConfigError(
            f"cannot make the folder {folder} ({error.strerror}): name another with --out"
        ) from None
    return folder
