"""`cogmap explain`: why the agent did what it did at a moment, from its log alone."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.explain import choice
from cogmap.cli.explain.facts import facts
from cogmap.cli.explain.moment import Moment, moment
from cogmap.cli.explain.screen import print_moment
from cogmap.cli.launch.plan import LOG_NAME
from cogmap.cli.log import formatting
from cogmap.cli.log.files import save
from cogmap.cli.options import FiniteRange, json_option
from cogmap.errors import UsageError
from cogmap.recording.log import Log, open_log

PICTURES = (".png", ".svg")
_EPILOG = """\b
Examples:
  cogmap explain drive.mcap                  the last broadcast
  cogmap explain runs/latest --at 12.5       of a run's log, that time of the drive
  cogmap explain drive.mcap --cycle 60 --picture cycle.png
"""


@click.command(epilog=_EPILOG)
@click.argument("log", type=click.Path(path_type=Path))
@click.option(
    "--at",
    "at_s",
    type=FiniteRange(min=0),
    metavar="SECONDS",
    help="The last cycle whose view is at or before this time of the drive.",
)
@click.option(
    "--cycle", "number", type=click.IntRange(min=0), metavar="N", help="The cycle of this number."
)
@click.option(
    "--picture",
    "picture",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Draw the cycle, as PNG or SVG.",
)
@json_option
def explain(
    log: Path, at_s: float | None, number: int | None, picture: Path | None, as_json: bool
) -> None:
    """Explain one moment of the drive in LOG, which may be a run's folder.

    What was perceived, which coalitions competed and why one became conscious, which action that
    led to and why no other, and the motor command that followed. Without --at or --cycle it is the
    last broadcast.
    """
    if at_s is not None and number is not None:
        raise click.UsageError("--at and --cycle both name a moment: leave one out")
    if picture is not None:
        _check(picture)

    found = _moment(open_log(_file(log)), at_s, number)
    if picture is not None:
        save(picture, _drawn(found, picture.suffix.lower()))
    if as_json:
        formatting.print_json(facts(found))
        return
    print_moment(found)
    if picture is not None:
        click.echo(f"\n{picture}: cycle {found.cycle} as a picture")


def _file(log: Path) -> Path:
    """The log, or the one in a run's folder."""
    return log / LOG_NAME if log.is_dir() else log


def _moment(log: Log, at_s: float | None, number: int | None) -> Moment:
    choice.require_decisions(log)
    if at_s is not None:
        cycle = choice.at_time(log, at_s)
    elif number is not None:
        cycle = choice.numbered(log, number)
    else:
        cycle = choice.last_broadcast(log)
    return moment(log, cycle.number, cycle.stamp_ns)


def _check(picture: Path) -> None:
    """Raise UsageError where `picture` cannot be a picture."""
    if picture.suffix.lower() not in PICTURES:
        raise UsageError(f"--picture {picture}: name a file that ends in {' or '.join(PICTURES)}")
    if not picture.parent.is_dir():
        raise UsageError(f"--picture {picture}: there is no folder {picture.parent}: make it first")


def _drawn(found: Moment, suffix: str) -> bytes:
    from cogmap.cli.plots.moment import figure as plot  # who reads text has no use for matplotlib

    return plot.figure(found, suffix)
