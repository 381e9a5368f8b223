"""`cogmap explain`: why the agent did what it did at a moment, from its log alone."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.explain import choice
from cogmap.cli.explain.facts import facts
from cogmap.cli.explain.moment import moment
from cogmap.cli.explain.screen import print_moment
from cogmap.cli.files import check_picture, save
from cogmap.cli.options import FiniteRange, json_option
from cogmap.cli.printing import print_json
from cogmap.recording.log import open_log

PICTURES = (".png", ".svg")
_EPILOG = """\b
Examples:
  cogmap explain drive.mcap                  the cycle of the last broadcast
  cogmap explain runs/latest --at 12.5       12.5 s into the last run
  cogmap explain drive.mcap --cycle 60 --picture cycle.png
"""


@click.command(epilog=_EPILOG)
@click.argument("log", type=click.Path(path_type=Path))
@click.option(
    "--at",
    "at_s",
    type=FiniteRange(min=0),
    metavar="SECONDS",
    help="Explain the cycle at this time of the log, in seconds since its first message.",
)
@click.option(
    "--cycle",
    "number",
    type=click.IntRange(min=0),
    metavar="N",
    help="Explain the cycle with this number.",
)
@click.option(
    "--picture",
    "picture",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Draw the cycle too, as PNG or SVG.",
)
@json_option
def explain(
    log: Path, at_s: float | None, number: int | None, picture: Path | None, as_json: bool
) -> None:
    """Explain one cognitive cycle of the drive in LOG, a log or the folder of a run.

    Shows what was perceived, which coalitions competed and why one became conscious, which action
    was chosen and why no other, and the motor command that followed. Without --at or --cycle it is
    the cycle of the last broadcast.
    """
    if at_s is not None and number is not None:
        raise click.UsageError("--at and --cycle both name a moment: leave one out")
    if picture is not None:
        check_picture("--picture", picture, PICTURES)

    opened = open_log(log)
    choice.require_decisions(opened)
    if at_s is not None:
        cycle = choice.at_time(opened, at_s)
    elif number is not None:
        cycle = choice.numbered(opened, number)
    else:
        cycle = choice.last_broadcast(opened)
    found = moment(opened, cycle.number, cycle.stamp_ns)

    if picture is not None:
        from cogmap.cli.explain.drawing.figure import figure  # matplotlib takes long to import

        save(picture, figure(found, picture.suffix.lower()))
    if as_json:
        print_json(facts(found))
        return

    print_moment(found)
    if picture is not None:
        click.echo(f"\n{picture}: cycle {found.cycle} as a picture")
