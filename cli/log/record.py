"""`cogmap log record`."""

from __future__ import annotations

import json
import math
import time
from pathlib import Path

import click

from cogmap.bus.access.subjects import RECORDER
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.log.choosing import (
    COMPRESSIONS,
    compression_option,
    exclude_option,
    regex_option,
)
from cogmap.cli.log.keys import RecordKeys
from cogmap.cli.log.report import print_summary
from cogmap.cli.options import FiniteRange, json_option
from cogmap.cli.printing import print_json
from cogmap.cli.topic.argument import topics_argument
from cogmap.recording import recorder, selection
from cogmap.runtime import config, environment
from cogmap.runtime.process import Stop, give_way
from cogmap.runtime.program import (
    agent_option,
    config_option,
    connect_option,
    set_option,
    tied_option,
)

_EPILOG = """\b
Examples:
  cogmap log record                          everything, until Ctrl-C
  cogmap log record -o drive.mcap -x camera  everything but the camera
  cogmap log record odometry motor/command   two topics
  cogmap log record -e '^workspace/'         what the workspace publishes
  cogmap log record -o drive.mcap --split-s 600    drive.mcap, drive-2.mcap ...
  cogmap log record -o log-2.mcap --after log.mcap    and what log.mcap lacks, having been killed
  cogmap log record -o week.mcap --split-mb 500 --keep 20  the last 10 GB
  cogmap log record -o fall.mcap --snapshot-s 30   the last half minute, whenever s is pressed
"""


@click.command(epilog=_EPILOG)
@topics_argument
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="The new file.  [default: cogmap_TIME.mcap]",
)
@click.option("-a", "--all", "everything", is_flag=True, help="Record every topic; the default.")
@regex_option
@exclude_option
@click.option(
    "-d",
    "--max-duration",
    type=FiniteRange(min=0, min_open=True),
    help="End after this many seconds.",
)
@click.option(
    "--split-s",
    type=FiniteRange(min=0, min_open=True),
    metavar="SECONDS",
    help="Begin another file after so long: OUTPUT-2, OUTPUT-3 ...",
)
@click.option(
    "--split-mb",
    type=FiniteRange(min=0, min_open=True),
    metavar="MB",
    help="Begin another file once one has so many megabytes.",
)
@click.option(
    "--keep",
    type=click.IntRange(min=1),
    metavar="FILES",
    help="Of a recording that is split, keep the newest so many finished files, and remove older "
    "ones.  [default: all]",
)
@click.option(
    "--snapshot-s",
    type=FiniteRange(min=0, min_open=True),
    metavar="SECONDS",
    help="Write nothing but the last so many seconds, at most 256 MB, into OUTPUT, OUTPUT-2 ... "
    "whenever s is pressed, or by `kill -USR1`.",
)
@click.option("--start-paused", is_flag=True, help="Begin paused; the space bar continues.")
@click.option(
    "--after",
    type=click.Path(dir_okay=False, path_type=Path),
    multiple=True,
    metavar="LOG",
    help="Continue the log of an earlier recorder of this run, which was killed: fetch what it "
    "lacks where its source still has it, and count the rest; may be repeated, oldest first.",
)
@compression_option
@click.option(
    "--instance",
    default=recorder.MODULE,
    show_default=True,
    help="A name of its own, if several processes record.",
)
@tied_option
@connect_option
@agent_option
@config_option
@set_option
@json_option
def record(
    topics: tuple[str, ...],
    output: Path | None,
    everything: bool,
    regex: str,
    exclude: str,
    max_duration: float | None,
    split_s: float | None,
    split_mb: float | None,
    keep: int | None,
    snapshot_s: float | None,
    start_paused: bool,
    after: tuple[Path, ...],
    compression: str,
    instance: str,
    tied: bool,
    connect: str,
    agent: str,
    config_path: Path | None,
    settings: tuple[str, ...],
    as_json: bool,
) -> None:
    """Record the messages on the bus into an MCAP file, until Ctrl-C.

    On a terminal the space bar pauses and continues; what comes meanwhile is counted.

    The file is written four times a second: killing the recorder loses at most 0.25 s. At the end
    the missing messages of each publisher are printed, and noted in the file. The file also holds
    the configuration, which `cogmap log replay` uses. Of a recording that was split, `cogmap log
    merge` makes one log again: a graph, and a replay into modules, need it from its beginning, so
    with all of its files, and without a pause.
    """
    if everything and (topics or regex):
        raise click.UsageError("--all records every topic: leave it out, or the choice of topics")

    if snapshot_s and (split_s or split_mb):
        raise click.UsageError(
            "--snapshot-s makes files of its own: leave --split-s and --split-mb out"
        )

    if keep and not (split_s or split_mb):
        raise click.UsageError("--keep counts the files of a split recording: add --split-mb")

    chosen = selection.to_record(topics, regex, exclude)
    about = {"agent": agent, "config": json.dumps(config.load(config_path, settings))}
    path = output or Path(f"cogmap_{time.strftime('%Y_%m_%d-%H_%M_%S')}.mcap")

    bus = ZenohBus(connect, agent, keys=environment.keys(RECORDER))
    keys = RecordKeys(Stop(tied), start_paused)  # only now: until a router answers, Ctrl-C ends it
    try:
        with keys.listening(), keys.signalled():
            recording = recorder.Recorder(
                bus,
                path,
                chosen,
                about,
                instance=instance,
                compression=COMPRESSIONS[compression],
                split=recorder.Split(
                    max_s=split_s or math.inf,
                    max_bytes=1e6 * (split_mb or math.inf),
                    keep=keep,
                ),
                snapshot_s=snapshot_s,
                after=after,
            )
            if tied:
                give_way()
            summary = recorder.run(recording, lambda: _ends(recording, keys), max_duration)
    finally:
        bus.close()

    if as_json:
        print_json(summary)
    else:
        print_summary(summary)


def _ends(recording: recorder.Recorder, keys: RecordKeys) -> bool:
    """Do what keys ask for. Return whether to end."""
    keys.wait(0.0)
    recording.is_paused = keys.paused
    if keys.take_snapshot():
        if recording.takes_snapshots:
            click.echo(f"wrote {recording.snapshot()}", err=True)
        else:
            click.echo("all is recorded: --snapshot-s writes only what is asked for", err=True)
    return keys.asked
