"""`cogmap run`: a drive through a simulated town, every module a process of its own."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from cogmap.cli.launch.command_line import ONE_THREAD
from cogmap.cli.launch.forking.client import fork_server
from cogmap.cli.options import FiniteRange, rules_option
from cogmap.cli.run.options import (
    LAP_LIMIT_S,
    codelets_option,
    dashboard_option,
    energy_option,
    explore_option,
    formats_of_recordings,
    goals_option,
    laps_option,
    lockstep_option,
    open_option,
    recording_option,
    seed_option,
    speed_option,
    tour_option,
    town_option,
)
from cogmap.runtime import config
from cogmap.runtime.program import (
    agent_option,
    config_option,
    connect_option,
    set_option,
    tied_option,
)
from cogmap.services import registry
from cogmap.services.codelets.rules import settings_of


@click.command(epilog=formats_of_recordings())
@seed_option
@town_option
@tour_option
@explore_option
@goals_option
@laps_option
@energy_option
@recording_option
@speed_option
@lockstep_option
@codelets_option
@dashboard_option
@open_option
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="A new folder for the files of the run.  [default: runs/TIME]",
)
@click.option(
    "--memory",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Use the long-term memory in the database FILE, and keep this run there.  "
    "[default: an empty memory]",
)
@click.option("--record/--no-record", default=True, help="Record all messages in a log, or none.")
@click.option(
    "--time-limit",
    type=FiniteRange(5, 1e6),
    metavar="SECONDS",
    help="End after this much time, start and end included.  "
    f"[default: {LAP_LIMIT_S:g} for each lap, start excluded]",
)
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
@click.option(
    "--router",
    metavar="ENDPOINT",
    help="Use the router that listens there, for example zenohd, instead of starting one.",
)
@click.option(
    "--without",
    multiple=True,
    type=click.Choice([*registry.MODULES, "all"]),
    metavar="MODULE",
    help="Do not start this module, but wait for yours; may be repeated, or `all`.",
)
@tied_option
@connect_option
@agent_option
@config_option
@rules_option
@set_option
def run(
    seed: int | None,
    town: str | None,
    tour: bool,
    explore_s: float | None,
    goals: Path | None,
    laps: float | None,
    energy: bool,
    recording: str | None,
    speed: float | None,
    lockstep: bool,
    codelets: int,
    dashboard: bool,
    opens_dashboard: bool,
    out: Path | None,
    memory: Path | None,
    record: bool,
    time_limit: float | None,
    as_json: bool,
    router: str | None,
    without: tuple[str, ...],
    tied: bool,
    connect: str,
    agent: str,
    config_path: Path | None,
    rules: str | None,
    settings: tuple[str, ...],
) -> None:
    """Drive the robot through a simulated town: to goals, by routes that it plans, or exploring.
    With --recording the agent lives through what somebody else's robot sensed.

    Starts a router and every module as a process of its own, shows the progress, and writes a log,
    a map and a summary into a new folder, which runs/latest links to. Ends with 0 if every goal
    was reached or all of a recording was played, with 130 after Ctrl-C, else with 1; the summary
    gives the reason.
    """
    with fork_server() as server:
        # While the server imports what it is to fork, this process imports what it needs itself.
        # Threads of linear algebra would wait for work in a loop, on the server's processor.
        os.environ.update(ONE_THREAD)
        from cogmap.cli.goal import read_goals
        from cogmap.cli.launch.plan import Choices
        from cogmap.cli.run.execution import Start, run_drive

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
            recording=recording or "",
            speed=speed,
            dashboard=dashboard or opens_dashboard,
            opens_dashboard=opens_dashboard,
        )
        of_rules = [] if rules is None else settings_of(rules)
        start = Start(
            choices=choices,
            given=config.load(config_path, [*of_rules, *settings]),
            endpoint=router or connect,
            agent=agent,
            out=out,
            time_limit_s=time_limit,
            as_json=as_json,
            tied=tied,
        )
        code = run_drive(start, server)
    sys.exit(code)
