"""Options that several benchmarks' commands have, and how each of them ends."""

from __future__ import annotations

import os
from pathlib import Path

import click

from benchmarks import suite
from benchmarks.report import Metrics, report
from benchmarks.threshold import Thresholds


def _writable(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Refuse a file that cannot be written before minutes of measuring."""
    if path is not None and not path.parent.is_dir():
        raise click.BadParameter(f"there is no folder {path.parent}: make it first")

    return path


json_option = click.option(
    "--json",
    "json_path",
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    callback=_writable,
    metavar="FILE",
    help="Write the metrics there too, as one flat object.",
)
processes_option = click.option(
    "--processes",
    type=click.IntRange(1, 256),
    default=os.cpu_count() or 1,
    help="How many run at once.  [default: one a core]",
)


def announce(sentence: str) -> None:
    """Print a sentence for who waits, beside the results."""
    click.echo(sentence, err=True)


def report_metrics(
    name: str, thresholds: Thresholds, metrics: Metrics, json_path: Path | None
) -> None:
    """Print what was measured beside its thresholds, and write it where a file is given."""
    measured = {key: limit for key, limit in thresholds.items() if key in metrics}
    outcome = suite.completed(name, measured, metrics)
    report(outcome, json_path)
