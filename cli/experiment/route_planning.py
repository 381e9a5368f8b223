"""`cogmap experiment route-planning`: experiment 3, figure 5 of the paper."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.experiment import results
from cogmap.cli.experiment.options import Common, common_options_without_sensing
from cogmap.cli.progress import bar
from cogmap.data.human_tours import read_folder
from cogmap.experiments.route_planning import published
from cogmap.experiments.route_planning.measure import (
    DRAWN,
    DRAWN_PARTICIPANTS,
    EXAMPLE_GOALS,
    PARTICIPANTS,
    SIZES,
    drawn_jobs,
    human_jobs,
    measure,
)
from cogmap.experiments.route_planning.metrics import drawn_metrics, human_metrics

NAME = "route-planning"
_EPILOG = """\b
Examples:
  cogmap experiment route-planning --json planning.json
  cogmap experiment route-planning --data human_tsp     beside people's tours
"""


@click.command(name=NAME, epilog=_EPILOG)
@click.option(
    "--data",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="People's tours: problems as GraphN.lib, in TSPLIB's format, and tours.csv, packed "
    "or not, with the columns graph, participant, x and y.",
)
@click.option(
    "--participants",
    type=click.IntRange(1, 10_000),
    default=PARTICIPANTS,
    show_default=True,
    help="Simulated participants for each problem in --data.",
)
@click.option(
    "--drawn",
    type=click.IntRange(1, 1000),
    default=DRAWN,
    show_default=True,
    help="Random problems of each number of goals.",
)
@click.option(
    "--max-goals",
    type=click.IntRange(EXAMPLE_GOALS, SIZES[-1]),
    default=SIZES[-1],
    show_default=True,
    help=f"Largest number of goals of random problems; the smallest is {SIZES[0]}.",
)
@common_options_without_sensing
def route_planning(
    common: Common, data: Path | None, participants: int, drawn: int, max_goals: int
) -> None:
    """Run experiment 3, figure 5: the order of several goals, planned on a hierarchy of maps and on
    a flat one.

    Tours of people, of the model and on the flat map are compared with the shortest tour, which is
    computed exactly. The model's participants judge lengths with an error of 3 %, begin at
    different goals and have different grids. Takes some minutes.
    """
    folder = results.folder_for(NAME, common.out)
    from_people = human_jobs(read_folder(data), participants, common.seed) if data else []
    sizes = [size for size in SIZES if size <= max_goals]
    from_seed = drawn_jobs(sizes, drawn, common.seed)

    with bar("planning tours") as progress:
        planned = measure([*from_people, *from_seed], common.processes, progress)

    human = planned[: len(from_people)]
    drawn_at_random = planned[len(from_people) :]
    metrics: dict[str, float | str] = {
        **human_metrics(human),
        **drawn_metrics(drawn_at_random),
        "participants": float(participants),
        "participants_of_drawn_problems": float(DRAWN_PARTICIPANTS),
        "published_of_4_to_9_goals": published.READ_OFF_BY_EYE,
    }
    results.show(NAME, metrics)

    from cogmap.cli.plots.route_planning import figure  # matplotlib takes long to import

    results.save(folder, NAME, figure(human, drawn_at_random, metrics), metrics, common)
