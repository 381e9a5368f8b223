"""`cogmap log`."""

from __future__ import annotations

import click

from cogmap.cli.verbs import add_verbs

VERBS = {
    "record": ("cogmap.cli.log.record:record", "Record the bus into an MCAP file."),
    "info": ("cogmap.cli.log.inspect:info", "Show what is in a log, and what is missing."),
    "summary": ("cogmap.cli.log.summary:summary", "Summarise the drive in a log."),
    "cat": ("cogmap.cli.log.inspect:cat", "Print messages."),
    "map": ("cogmap.cli.log.summary:draw_map", "Draw the true town and the learned map."),
    "image": ("cogmap.cli.log.pictures:image", "Save a camera image."),
    "perception": ("cogmap.cli.log.pictures:perception", "Draw what was perceived in a view."),
    "predictions": (
        "cogmap.cli.log.predictions:predictions",
        "Draw what a drive predicts of place cells.",
    ),
    "export": (
        "cogmap.cli.log.export:export",
        "Write a log for other tools: tables, Foxglove, Rerun, ROS.",
    ),
    "convert": (
        "cogmap.cli.log.convert:convert",
        "Write a log or a bag as what a name ends with.",
    ),
    "import": ("cogmap.cli.log.importing:import_bag", "Make a log of a bag of ROS."),
    "replay": ("cogmap.cli.log.replay:replay", "Play a log onto the bus, or into modules."),
    "diff": ("cogmap.cli.log.inspect:diff", "Compare two logs message by message."),
    "filter": ("cogmap.cli.log.copying:filter_", "Write a part of a log as another log."),
    "merge": ("cogmap.cli.log.copying:merge", "Write several logs as one."),
    "recover": ("cogmap.cli.log.inspect:recover", "Save what is readable of a cut log."),
}
_EPILOG = """\b
A first session, while `cogmap run` runs in another terminal:
  cogmap log record -o drive.mcap     Ctrl-C ends it
  cogmap log info drive.mcap          what is in it
  cogmap log summary drive.mcap       how the drive went
  cogmap log map drive.mcap           the true town and the learned map
  cogmap log cat drive.mcap action/selected
  cogmap log image drive.mcap         a camera image, as a file
  cogmap log predictions drive.mcap   replays, shifts of place fields, synapses
  cogmap log replay drive.mcap --into sensory
  cogmap log export drive.mcap --csv tables
  cogmap log filter drive.mcap small.mcap -x 'camera|view'
  cogmap log import drive.bag drive.mcap
  cogmap log summary runs/latest      a run's folder stands for its log
"""


@click.group(epilog=_EPILOG)
def log() -> None:
    """Record all messages on the bus; inspect, draw, replay, compare, cut and recover logs."""


add_verbs(log, VERBS)
