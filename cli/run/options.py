"""Options of a drive, and its time limit without them."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.options import FiniteRange
from cogmap.services.player.formats import FORMATS

LAP_LIMIT_S = 85.0
"""The wall-clock time that a lap may take, its end included; it takes some 60 s."""
AROUND_S = 30.0
"""The wall-clock time that a drive may take to end, or to lag behind its own time."""

seed_option = click.option(
    "--seed", type=click.IntRange(0, 2**32), help="Seed of the town and of all noise.  [default: 1]"
)


def known_town(context: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Refuse a town that does not exist. Raises ConfigError."""
    if value is not None:
        from cogmap.services.sim.layout import towns

        towns.check(value)
    return value


town_option = click.option(
    "--town",
    metavar="TOWN",
    callback=known_town,
    help="The town: loop, blocks, osm:FILE for an OpenStreetMap extract, or FILE.toml for one of "
    "your own (cogmap town).  [default: loop]",
)
tour_option = click.option(
    "--tour",
    is_flag=True,
    help="A tour of the town, one of blocks unless --town names another: explore it, drive to "
    "three goals, avoid a closed street.",
)
goals_option = click.option(
    "--goals",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Drive to the goals in FILE, one per line: a name, or x and y in metres.",
)
explore_option = click.option(
    "--explore",
    "explore_s",
    type=FiniteRange(1, 1e5),
    metavar="SECONDS",
    help="Explore for this long, then drive to the goals, or back to the start.",
)
energy_option = click.option(
    "--energy",
    is_flag=True,
    help="Give the robot a battery, which it has to charge at charging places in the town.",
)
laps_option = click.option(
    "--laps",
    type=FiniteRange(0, 1000, min_open=True),
    help="Drive around the loop this many times: the goals are its corners.  [default: 1]",
)
codelets_option = click.option(
    "--codelets",
    type=click.IntRange(1, 64),
    default=1,
    show_default=True,
    help="How many processes run codelets.",
)
recording_option = click.option(
    "--recording",
    metavar="FORMAT:PATH",
    help="Play a recording in the place of the simulation; the formats are listed below.",
)
speed_option = click.option(
    "--speed",
    type=FiniteRange(0.01, 100),
    help="Play the recording this many times as fast as it was recorded.  [default: 1]",
)
dashboard_option = click.option(
    "--dashboard",
    is_flag=True,
    help="Serve a dashboard, for a browser, as `cogmap dashboard` does.",
)
open_option = click.option(
    "--open-dashboard", "opens_dashboard", is_flag=True, help="Serve it, and open it in a browser."
)
lockstep_option = click.option(
    "--lockstep/--real-time",
    help="In lockstep the simulation waits for every module: one seed, the same bytes.  "
    "[default: real time]",
)


def formats_of_recordings() -> str:
    """List the formats of recordings, for the end of the help."""
    rows = [f"  {name + ':PATH':<15} {each.path}" for name, each in FORMATS.items()]
    return "\n".join(["\b", "Recordings:", *rows])
