"""`cogmap log summary` and `map`: what a run leaves, from its log alone."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import click
import msgspec
from rich.console import Console

from cogmap.bus.interface import Arrival
from cogmap.cli.launch.metrics import RecordedMetrics, Recording, drive_metrics
from cogmap.cli.launch.tally import FOLLOWED, Tally
from cogmap.cli.log import formatting
from cogmap.cli.log.inspect import log_argument
from cogmap.cli.log.progress import bar
from cogmap.cli.options import json_option
from cogmap.cli.run.summary import recorded_table
from cogmap.errors import MessageError, NoAnswerError, UsageError
from cogmap.graph.graph import Graph
from cogmap.graph.replica import Fetched, Replica
from cogmap.recording.log import recorded_config
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.writer import cannot_write
from cogmap.runtime.delivery.intake import Intake
from cogmap.schemas import topics
from cogmap.schemas.graph import SnapshotRequest
from cogmap.services import registry

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
    """Summarise the drive in LOG as `cogmap run` does: how far, how well it knew where it was, what
    it learned, how fast it was and what was lost.
    """
    reader = LogReader(log)
    metrics, _ = _followed(reader)
    if as_json:
        formatting.print_json(metrics)
    else:
        Console().print(recorded_table(metrics, log))


@click.command("map", epilog=_MAP_EPILOG)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="The file; named by LOG otherwise."
)
@log_argument
def draw_map(log: Path, output: Path | None) -> None:
    """Draw the town as it is and as the agent has come to know it by the end of LOG, as PNG or PDF.

    It is the map.png of `cogmap run`: streets and buildings, the true path, the estimated one and
    path integration alone, the streets and buildings that were learned.
    """
    from cogmap.cli.plots import map as plot  # other commands have no use for matplotlib

    path = output or Path(f"{log.stem}-map{PLOTS[0]}")
    if path.suffix.lower() not in PLOTS:
        raise UsageError(f"-o {path}: name a file that ends in {' or '.join(PLOTS)}")
    metrics, tally = _followed(LogReader(log))

    logging.getLogger("matplotlib").setLevel(logging.WARNING)
    try:
        plot.draw(path, tally.observer, tally.replica.graph, metrics)
    except OSError as error:
        raise cannot_write(path, error) from None
    click.echo(
        f"{path}: {metrics.distance_m:.0f} m of driving, {metrics.objects} buildings learned"
    )


def _followed(reader: LogReader) -> tuple[RecordedMetrics, Tally]:
    """The metrics of the drive in a log, and what its messages amount to. Raises LogError."""
    config = recorded_config(reader)
    tally = Tally(Replica(_no_snapshot, Graph()))
    intake = Intake()
    with bar(f"reading {reader.path.name}") as progress:
        for record in reader.records(FOLLOWED, progress):
            payload = reader.payload(record)
            arrival = Arrival(record.topic, payload, record.envelope, record.log_time_ns)
            _count(arrival, intake, tally)

    _warn(reader, tally)
    metrics = drive_metrics(tally, tally.gaps(intake.gaps), tally.rejected(intake.rejected))
    recorded = RecordedMetrics(
        **msgspec.structs.asdict(metrics),
        completed=metrics.progress >= 1.0,
        seed=int(_setting(config, "sim", "seed")),
        lockstep=bool(_setting(config, "run", "lockstep")),
        log=Recording.read(reader.path),
    )
    return recorded, tally


def _count(arrival: Arrival, intake: Intake, tally: Tally) -> None:
    message = intake.accept(arrival)
    if message is None or arrival.envelope is None:
        return
    try:
        tally.update(message, arrival.envelope, arrival.received_ns)
    except MessageError as error:
        intake.reject(arrival.topic.name, str(error))


def _warn(reader: LogReader, tally: Tally) -> None:
    """Name what the log lacks for a summary."""
    if tally.observer.start is None:
        click.echo(
            f"{reader.path} holds no {topics.TRUE_POSE.name}: distances and errors are 0", err=True
        )
    if tally.replica.is_behind:
        version = tally.replica.graph.version
        click.echo(
            f"{reader.path} lacks a {topics.DELTA.name} after number {version}: what was learned "
            "later is not shown",
            err=True,
        )


def _setting(config: dict[str, dict[str, Any]], module: str, key: str) -> Any:
    """A recorded setting, or its default where the log does not hold it."""
    recorded = config.get(module, {})
    if key in recorded:
        return recorded[key]
    return getattr(registry.config_type(module)(), key)


def _no_snapshot(_request: SnapshotRequest) -> Fetched:
    """A log has no workspace to ask."""
    raise NoAnswerError("a log holds no snapshots")
