"""`cogmap log summary` and `map`: the summary and the map of a run, from its log alone."""

from __future__ import annotations

import logging
from pathlib import Path

import click
import msgspec
from rich.console import Console

from cogmap.bus.interface import Arrival
from cogmap.cli.files import check_picture
from cogmap.cli.launch.drive_metrics import (
    RecordedMetrics,
    Recording,
    drive_metrics,
    headline,
)
from cogmap.cli.launch.tally import FOLLOWED, Tally
from cogmap.cli.log.inspect import log_argument
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.progress import bar
from cogmap.cli.run.summary import recorded_table
from cogmap.errors import NoAnswerError
from cogmap.graph.graph import Graph
from cogmap.graph.replica import Fetched, Replica
from cogmap.recording.log import recorded_config
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.writer import cannot_write
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.run import SECTION, Run
from cogmap.schemas import topics
from cogmap.schemas.graph import SnapshotRequest
from cogmap.services.sim.config import Config as SimConfig

PLOTS = (".png", ".pdf")
_MAP_EPILOG = """\b
Examples:
  cogmap log map drive.mcap                  drive-map.png
  cogmap log map drive.mcap -o town.pdf
"""


@click.command()
@log_argument
@json_option
def summary(log: Path, as_json: bool) -> None:
    """Summarise the drive in LOG as `cogmap run` does.

    Prints how far the robot drove, the errors of its position, what it learned, how long a
    cognitive cycle took, and which messages were lost.
    """
    reader = LogReader(log)
    metrics, _ = _followed(reader)
    if as_json:
        print_json(metrics)
    else:
        Console().print(recorded_table(metrics, log))


@click.command("map", epilog=_MAP_EPILOG)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="The picture.  [default: LOG-map.png]"
)
@log_argument
def draw_map(log: Path, output: Path | None) -> None:
    """Draw the true town, and the agent's map at the end of LOG, as PNG or PDF.

    The picture is the map.png of `cogmap run`: streets and buildings with their names, the true
    path, the estimated one and path integration alone, the streets and buildings that were learned,
    goals and plan. Its axes are those in which `cogmap goal X Y` takes goals.
    """
    from cogmap.cli.plots.map import picture as plot  # other commands have no use for matplotlib

    path = output or Path(f"{log.stem}-map{PLOTS[0]}")
    check_picture("-o", path, PLOTS)
    metrics, tally = _followed(LogReader(log))

    logging.getLogger("matplotlib").setLevel(logging.WARNING)
    try:
        with bar(f"drawing {path}"):
            plot.draw(path, tally, metrics)
    except OSError as error:
        raise cannot_write(path, error) from None
    click.echo(f"{path}: {metrics.distance_m:.0f} m of driving; buildings: {headline(metrics)}")


def _followed(reader: LogReader) -> tuple[RecordedMetrics, Tally]:
    """Compute the metrics of the drive in a log, and tally its messages. Raises LogError.

    Warns of what the log lacks for them.
    """
    tally = Tally(Replica(_no_snapshot, Graph()))
    intake = Intake()
    with bar(f"reading {reader.path.name}") as progress:
        for record in reader.records(FOLLOWED, progress):
            payload = reader.payload(record)
            arrival = Arrival(record.topic, payload, record.envelope, record.log_time_ns)
            tally.receive(arrival, intake)

    if tally.observer.start is None:
        name = topics.TRUE_POSE.name
        click.echo(f"{reader.path} holds no {name}: distances and errors are 0", err=True)
    if tally.replica.is_behind:
        version = tally.replica.graph.version
        click.echo(
            f"{reader.path} lacks a {topics.DELTA.name} after number {version}: what was learned "
            "later is not shown",
            err=True,
        )

    recorded = recorded_config(reader)
    sim = recorded.get("sim", {})
    lockstep = recorded.get(SECTION, {}).get("lockstep", Run().lockstep)
    metrics = drive_metrics(tally, tally.gaps(intake.gaps), tally.rejected(intake.rejected))
    of_log = RecordedMetrics(
        **msgspec.structs.asdict(metrics),
        completed=metrics.progress >= 1.0,
        town=str(sim.get("town", SimConfig().town)),
        seed=int(sim.get("seed", SimConfig().seed)),
        lockstep=bool(lockstep),
        log=Recording.read(reader.path),
    )
    return of_log, tally


def _no_snapshot(_request: SnapshotRequest) -> Fetched:
    """Raise NoAnswerError: a log has no workspace to ask."""
    raise NoAnswerError("a log holds no snapshots")
