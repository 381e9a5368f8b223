"""`cogmap run`: a drive around the simulated town, every module a process of its own."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cogmap.cli.launch.command_line import ONE_THREAD
from cogmap.cli.launch.forking.client import fork_server
from cogmap.cli.options import FiniteRange, agent_option, config_option, connect_option, set_option
from cogmap.runtime import config
from cogmap.services import registry

if TYPE_CHECKING:
    from cogmap.cli.launch.plan import Choices

LAP_LIMIT_S = 85.0
AROUND_S = 30.0

seed_option = click.option(
    "--seed", type=click.IntRange(0, 2**32), help="Which town, and which noise.  [default: 1]"
)


def _known_town(context: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Refuse a town that there is none of. Raises ConfigError."""
    if value is not None:
        from cogmap.services.sim.layout import towns

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
    with fork_server() as server:
        # While the server imports what it is to fork, this process imports what it needs itself.
        # Threads of linear algebra would wait for work in a loop, on the server's processor.
        os.environ.update(ONE_THREAD)
        from cogmap.cli.goal import read_goals
        from cogmap.cli.launch.plan import Choices
        from cogmap.cli.run.drive import Start, run_drive

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
        start = Start(
            choices=choices,
            given=config.load(config_path, settings),
            endpoint=router or connect,
            agent=agent,
            out=out,
            time_limit_s=time_limit,
            as_json=as_json,
        )
        code = run_drive(start, server)
    sys.exit(code)


def default_limit_s(sim: dict[str, Any], choices: Choices) -> float:
    """The time limit of a drive with these settings of the simulation.

    It grows with each lap, and is one lap's at least; without laps it is the drive's duration, and
    time to start and to end.
    """
    from cogmap.services.sim.layout.towns import LOOP

    has_laps = not (choices.tour or choices.goals or choices.explore_s)
    if sim["town"] == LOOP and has_laps:
        return LAP_LIMIT_S * max(1.0, choices.laps or 1.0)

    return float(sim["duration_s"]) + AROUND_S
