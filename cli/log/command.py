"""`cogmap log`."""

from __future__ import annotations

import click

from cogmap.cli.log.drive import draw_map, summary
from cogmap.cli.log.inspect import cat, diff, info, recover
from cogmap.cli.log.pictures import image, perception
from cogmap.cli.log.record import record
from cogmap.cli.log.replay import replay

_EPILOG = """\b
A first session, with `cogmap run` going on in another terminal:
  cogmap log record -o drive.mcap     Ctrl-C ends it
  cogmap log info drive.mcap          what is in it
  cogmap log summary drive.mcap       how the drive went
  cogmap log map drive.mcap           the town and what was learned of it
  cogmap log cat drive.mcap action/selected
  cogmap log image drive.mcap         a view, as a file
  cogmap log replay drive.mcap --into sensory
"""


@click.group(epilog=_EPILOG)
def log() -> None:
    """Record what travels on the bus; look at it, draw what was seen, play it back, compare it,
    recover it.
    """


for _command in (
    record,
    info,
    summary,
    cat,
    draw_map,
    image,
    perception,
    replay,
    diff,
    recover,
):
    log.add_command(_command)
