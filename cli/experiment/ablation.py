"""`cogmap experiment ablation`: our rules, each taken away in turn, beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from cogmap.cli.experiment import results
from cogmap.cli.experiment.options import Common, common_options_without_sensing
from cogmap.cli.progress import bar
from cogmap.experiments.ablation import city, errands, loop, recorded, town
from cogmap.experiments.ablation.measure import ERROR, Domain, measure
from cogmap.experiments.ablation.metrics import Metrics, ablation_metrics
from cogmap.experiments.ablation.variants import LABELS, OURS

NAME = "ablation"
SEEDS = 5
ERRANDS = 3
"""Of the seeds: the drives take long."""

_EPILOG = """\b
Examples:
  cogmap experiment ablation --json ablation.json
  cogmap experiment ablation --mrclam MRCLAM_Dataset6   robots' logs, too
  cogmap experiment ablation --cities extracts --seeds 10
"""


@click.command(name=NAME, epilog=_EPILOG)
@click.option(
    "--seeds",
    type=click.IntRange(1, 1000),
    default=SEEDS,
    show_default=True,
    help="How many seeds from --seed on: towns, cities, and paths of figure 6; "
    f"of errands the first {ERRANDS}.",
)
@click.option(
    "--cities",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Every extract (.osm, packed or not, .osm.pbf) and street graph (.jsonl, packed or not) "
    "in a folder, in the place of cities grown from the seeds.",
)
@click.option(
    "--mrclam",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="A folder of the UTIAS MRCLAM sets, as published, its files packed or not: its robots' "
    "logs, too.",
)
@common_options_without_sensing
def ablation(common: Common, seeds: int, cities: Path | None, mrclam: Path | None) -> None:
    """Measure what each of our additions to the paper's model gains: with our rules, with one of
    them taken away at a time, and with all of the paper's.

    Laps of a town whose goals the agent plans its way to, errands to several goals in an order of
    its own, maps of cities, and the path of figure 6, all at the level of percepts: nothing is
    rendered. Beside each stands path integration alone, of
    fused self-motion and of wheels. A run that is lost, or ends early, is counted. Takes some ten
    minutes on two cores; with --mrclam several times as long.
    """
    folder = results.folder_for(NAME, common.out)
    chosen = range(common.seed, common.seed + seeds)

    with bar("choosing cities"):
        driven_in = domains(chosen, cities, mrclam)
    with bar("drives") as progress:
        measured = measure(driven_in, common.processes, progress)

    metrics = ablation_metrics(driven_in, measured)
    metrics["seeds"] = float(seeds)
    Console().print(table(driven_in, metrics))

    from cogmap.cli.plots.ablation import figure  # matplotlib takes long to import

    results.save(folder, NAME, figure(driven_in, measured), metrics, common)


def domains(seeds: Sequence[int], cities: Path | None, mrclam: Path | None) -> list[Domain]:
    """Return what is driven, the longest drives first: cities of a folder, and the robots of an
    MRCLAM set, if they are given.
    """
    logs = [] if mrclam is None else recorded.of_set(mrclam)
    towns = [town.TownDrive(seed) for seed in seeds]
    traversals = city.grown(seeds) if cities is None else city.of_extracts(cities, seeds)
    loops = [loop.LoopDrive(seed) for seed in seeds]
    tasks = [errands.Errands(seed) for seed in seeds[:ERRANDS]]
    found = [
        Domain("mrclam", "MRCLAM, path in the end", "m", logs),
        Domain("town", "town, estimate", "m", towns, plans=True),
        Domain(
            "errands",
            "errands, way over the shortest",
            "over_shortest",
            tasks,
            plans=True,
            quantity="way",
        ),
        Domain("cities", "cities, buildings", "km2", traversals),
        Domain("loop", "figure 6, path in the end", "m", loops),
    ]
    return [domain for domain in found if domain.cases]


def table(shown: Sequence[Domain], metrics: Metrics) -> Table:
    """Return mean and SD of the errors, in parentheses the mean over fused self-motion's, and how
    many runs were lost.
    """
    headings = [_heading(domain) for domain in shown]
    rows = Table("rules", *headings, title="errors, mean ± SD (over fused self-motion alone)")

    for variant, label in LABELS.items():
        cells = [_cell(f"{domain.name}_{variant}", domain, metrics) for domain in shown]
        rows.add_row(label, *cells)

    rows.add_section()
    for alone in ("fused", "wheels"):
        cells = []
        for domain in shown:
            name = f"{domain.name}_{OURS}_{alone}_{domain.quantity}_{domain.unit}"
            cells.append(_spread(name, metrics) if domain.quantity == ERROR else "")
        rows.add_row(f"{alone} alone, on our drives", *cells)

    return rows


def _heading(domain: Domain) -> str:
    return f"{domain.label}, {domain.unit}" if domain.quantity == ERROR else domain.label


def _cell(name: str, domain: Domain, metrics: Metrics) -> str:
    over = metrics.get(f"{name}_over_fused_mean")
    lost = metrics[f"{name}_lost"]
    text = _spread(f"{name}_{domain.quantity}_{domain.unit}", metrics)
    if over is not None:
        text += f" ({over:.2f})"
    if lost:
        text += f", {lost:g} of {metrics[f'{name}_runs']:g} lost"
    return text


def _spread(name: str, metrics: Metrics) -> str:
    mean = metrics[f"{name}_mean"]
    sd = metrics[f"{name}_sd"]
    if mean is None:
        return "no number"
    return f"{mean:.3g}" if sd is None else f"{mean:.3g} ± {sd:.2g}"
