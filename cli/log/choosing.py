"""Options of which messages of a log are meant, and how a log is written."""

from __future__ import annotations

import click
from mcap.writer import CompressionType

from cogmap.cli.options import FiniteRange
from cogmap.errors import UsageError

COMPRESSIONS = {each.name.lower(): each for each in CompressionType}

regex_option = click.option(
    "-e", "--regex", default="", metavar="PATTERN", help="Topics that match this pattern too."
)
exclude_option = click.option(
    "-x", "--exclude", default="", metavar="PATTERN", help="No topics that match this pattern."
)
start_option = click.option(
    "--start-offset",
    "start_s",
    type=FiniteRange(min=0),
    default=0.0,
    metavar="SECONDS",
    help="Begin this long after the start of the log.",
)
until_option = click.option(
    "--until",
    "until_s",
    type=FiniteRange(min=0, min_open=True),
    metavar="SECONDS",
    help="End this long after the start of the log.",
)
compression_option = click.option(
    "--compression",
    type=click.Choice(list(COMPRESSIONS)),
    default=CompressionType.LZ4.name.lower(),
    show_default=True,
    help="How the file is compressed: zstd makes it smaller, and takes more time.",
)


def check_span(start_s: float, until_s: float | None) -> None:
    """Raise UsageError if nothing is between these times."""
    if until_s is not None and until_s <= start_s:
        raise UsageError(f"--until {until_s:g}: it must be later than --start-offset {start_s:g}")
