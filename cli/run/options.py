"""Options of a drive, and its time limit without them."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.options import FiniteRange

LAP_LIMIT_S = 85.0
"""The wall-clock time that a lap may take, start and end included; it takes some 60 s."""
AROUND_S = 30.0
"""The wall-clock time that a drive may take to start and to end."""

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
