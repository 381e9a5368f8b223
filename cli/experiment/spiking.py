"""`cogmap experiment spiking`: figure 4 of the paper, step by step along a walk."""

from __future__ import annotations

from functools import partial
from typing import Any

import click

from cogmap.cli.experiment import results
from cogmap.cli.experiment.options import Common, common_options_without_sensing
from cogmap.cli.progress import bar
from cogmap.experiments.spiking.metrics import walk_metrics
from cogmap.experiments.spiking.recursion import measured
from cogmap.parallel import parallel_map

NAME = "spiking"
_EPILOG = """\b
Examples:
  cogmap experiment spiking --json spiking.json
  cogmap experiment spiking --cycles 3200   finer samples of the posterior
"""


@click.command(name=NAME, epilog=_EPILOG)
@click.option(
    "--walks",
    type=click.IntRange(1, 1000),
    default=10,
    show_default=True,
    help="How many walks, of the seeds from --seed on.",
)
@click.option(
    "--steps",
    type=click.IntRange(10, 5000),
    default=200,
    show_default=True,
    help="Steps of a walk, 15 cm each.",
)
@click.option(
    "--cycles",
    type=click.IntRange(100, 100_000),
    default=800,
    show_default=True,
    help="Gamma cycles a step, and samples of the rules without spikes.",
)
@common_options_without_sensing
def spiking(common: Common, walks: int, steps: int, cycles: int) -> None:
    """Make figure 4 recursive: grid cells move, place cells fire where border cells coincide, and
    the grid cells' phases are reset to that firing, step by step through a room.

    Beside it stand rejection of as many samples, both rules with samples that start from their mean
    (the paper's table 1), and the exact posterior on a fine grid: errors against the truth, and the
    distance of each distribution from the exact one. One posterior in detail, with its spikes, is
    `python -m benchmarks spiking`. Takes a minute or two.
    """
    folder = results.folder_for(NAME, common.out)
    seeds = range(common.seed, common.seed + walks)
    with bar("walking") as progress:
        work = partial(measured, steps=steps, cycles=cycles)
        walked = parallel_map(work, seeds, common.processes, progress)

    metrics: dict[str, Any] = walk_metrics(walked)
    metrics |= {"walks": float(walks), "steps": float(steps), "cycles": float(cycles)}
    results.show(NAME, metrics)

    from cogmap.cli.plots.spiking import figure  # matplotlib takes long to import

    results.save(folder, NAME, figure(walked), metrics, common)
