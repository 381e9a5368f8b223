"""The commands of `python -m benchmarks`, made from the table of benchmarks."""

from __future__ import annotations

import inspect
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from benchmarks import suite
from benchmarks.benchmark import PROCESSES, Benchmark, Setting
from benchmarks.report import Outcome, report, summary, with_machine_unit, write


def _writable(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Refuse a file that cannot be written before minutes of measuring."""
    if path is not None and not path.parent.is_dir():
        raise click.BadParameter(f"there is no folder {path.parent}: make it first")

    return path


JSON = click.Option(
    ["--json", "json_path"],
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    callback=_writable,
    metavar="FILE",
    help="Write the metrics there too, as one flat object.",
)


def announce(sentence: str) -> None:
    """Print a sentence for who waits, beside the results."""
    click.echo(sentence, err=True)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def benchmarks() -> None:
    """Measure Cogmap on this machine.

    Each prints a table of what was measured, the threshold beside it, and whether it is met; only
    `all` ends with code 1 if one is missed. Ratios are measured in one run. Timings stand beside
    machine_unit_ms, the time of one stereo matching, so that two machines can be compared. Leave
    the machine alone meanwhile.

    \b
    python -m benchmarks all --data DIR --json all.json
    python -m benchmarks cycle --json cycle.json
    python -m benchmarks map_correction --graph manhattan.g2o --json map_correction.json
    """


@benchmarks.command(
    name="all",
    params=[
        click.Option(
            ["--data"],
            type=click.Path(exists=True, file_okay=False, path_type=Path),
            metavar="DIR",
            help="Sets that others published, a folder each: mrclam6, pose_graphs, stereo_cones, "
            "camvid, corridor, kitti_stereo, street_grids, tsplib, human_tsp, victoria_park, "
            "plaza1.",
        ),
        click.Option(
            ["--only"],
            type=click.Choice(suite.NAMES),
            multiple=True,
            help="Just this one; repeatable.",
        ),
        click.Option(
            ["--skip"],
            type=click.Choice(suite.NAMES),
            multiple=True,
            help="Not this one; repeatable.",
        ),
        PROCESSES,
        JSON,
    ],
)
def all_command(
    data: Path | None,
    only: tuple[str, ...],
    skip: tuple[str, ...],
    processes: int,
    json_path: Path | None,
) -> None:
    """Run every benchmark and experiment that has a threshold, and print one table.

    Ends with code 1 if a threshold is missed. A benchmark that fails is a row with its reason, and
    counts as missed. Takes more than four hours on two cores.
    """
    chosen = suite.selected(only, skip)
    outcomes: list[Outcome] = []
    with tempfile.TemporaryDirectory() as folder:
        setting = Setting(Path(folder), processes, announce)
        for number, benchmark in enumerate(chosen, start=1):
            announce(f"[{number}/{len(chosen)}] {benchmark.name}")
            outcomes.append(suite.run(benchmark, setting, data))

            # After each, so that an interrupted run leaves what was measured.
            if json_path is not None:
                write(json_path, suite.merged(outcomes))

    Console().print(summary(outcomes))

    if any(outcome.failure or outcome.missed for outcome in outcomes):
        sys.exit(1)


def run_one(
    benchmark: Benchmark, *, json_path: Path | None, processes: int = 1, **options: Any
) -> None:
    """Run one benchmark with the options of its command, and print its table."""
    with tempfile.TemporaryDirectory() as folder:
        metrics = benchmark.measure(Setting(Path(folder), processes, announce), **options)

    possible = benchmark.thresholds | benchmark.option_thresholds
    thresholds = {key: limit for key, limit in possible.items() if key in metrics}
    name = benchmark.name.replace("_", " ")
    report(Outcome(name, thresholds, with_machine_unit(metrics)), json_path)


for row in suite.SUITE:
    if row.has_command:
        command = click.Command(
            row.name,
            help=inspect.getdoc(row.measure),
            params=[*row.options, JSON],
            callback=partial(run_one, row),
        )
        benchmarks.add_command(command)
