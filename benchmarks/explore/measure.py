"""Metrics of exploration, and of drives to goals: ten towns, percept-level sensing, the first of
them also with cameras.
"""

from __future__ import annotations

from dataclasses import dataclass

import click
import numpy as np

from benchmarks.benchmark import PROCESSES, Setting
from benchmarks.explore.boundaries import BoundaryScore
from benchmarks.explore.experimenter import Experimenter
from benchmarks.explore.trials import Trial
from benchmarks.harness import agent_modules, build, running, town_sections
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.cli.progress import bar
from cogmap.parallel import parallel_map
from cogmap.schemas import topics

TOWNS = 10
FIRST_SEED = 101
EXPLORE_S = 900.0
GOALS = 10
THRESHOLDS = {
    "explored_share": at_least(0.9),
    "goals_reached_share": at_least(1),
    "way_over_shortest": at_most(1.12),
    "collisions": at_most(0),
    "boundary_precision": at_least(0.9),
    "boundary_recall": at_least(0.9),
}

OPTIONS = (
    click.Option(
        ["--towns"],
        type=click.IntRange(1, 1000),
        default=TOWNS,
        show_default=True,
        help="How many; the metrics are of all.",
    ),
    PROCESSES,
)


@dataclass(frozen=True)
class Visit:
    """A town, by its seed, whether it is seen with cameras, and what is done there."""

    seed: int
    has_cameras: bool
    explore_s: float
    goals: int


@dataclass(frozen=True)
class Town:
    """What one town gave."""

    explored_share: float
    boundaries: BoundaryScore
    trials: list[Trial]
    collisions: int


def visit(chosen: Visit) -> Town:
    """Explore one town, then drive to goals in it. Raises CogmapError if a module rejected a
    message.
    """
    configured = town_sections(chosen.seed, chosen.has_cameras)
    experimenter = Experimenter(chosen.seed, chosen.explore_s, chosen.goals)
    modules = build(("sim", *agent_modules(chosen.has_cameras)), configured)
    emits = (topics.OFFER, topics.STREET_CLOSURE)
    with running([*modules, experimenter.module("experimenter", emits)]) as runner:
        runner.run(lambda: experimenter.is_complete)

    assert experimenter.boundaries is not None
    return Town(
        explored_share=experimenter.explored_share,
        boundaries=experimenter.boundaries,
        trials=experimenter.trials,
        collisions=experimenter.collisions,
    )


def measure(setting: Setting, *, towns: int = TOWNS) -> Metrics:
    """Measure how much of a town an agent explores by itself in 15 minutes, and how well it then
    finds its goals.

    Towns of several blocks at the level of percepts, the modules on the in-memory bus. Then ten
    goals a town, half of them with a street of the planned route closed on the way. The first town
    is also explored with cameras; its figures are beside the others, with `cameras` before them.
    Takes over an hour on two cores.
    """
    visits = [Visit(FIRST_SEED, True, EXPLORE_S, GOALS)]
    for seed in range(FIRST_SEED, FIRST_SEED + towns):
        visits.append(Visit(seed, False, EXPLORE_S, GOALS))

    with bar("exploring") as progress:
        with_cameras, *without = parallel_map(visit, visits, setting.processes, progress)

    of_cameras = metrics([with_cameras])
    return metrics(without) | {f"cameras_{key}": value for key, value in of_cameras.items()}


def metrics(towns: list[Town]) -> Metrics:
    """Average over towns, and over all drives that reached their goal."""
    trials = [trial for town in towns for trial in town.trials]
    reached = [trial for trial in trials if trial.driven_m is not None]
    shares = [town.explored_share for town in towns]

    return {
        "explored_share": float(np.mean(shares)),
        "goals_reached_share": len(reached) / max(1, len(trials)),
        "way_over_shortest": _mean_over_shortest(reached),
        "way_over_shortest_open": _mean_over_shortest(
            [each for each in reached if not each.closed]
        ),
        "unwarned_over_shortest": _mean([each.unwarned_m / each.shortest_m for each in reached]),
        "way_over_unwarned": _mean([each.over_unwarned for each in reached]),
        "boundary_precision": float(np.mean([town.boundaries.precision for town in towns])),
        "boundary_recall": float(np.mean([town.boundaries.recall for town in towns])),
        "collisions": float(sum(town.collisions for town in towns)),
    }


def _mean_over_shortest(trials: list[Trial]) -> float:
    return _mean([trial.over_shortest for trial in trials])


def _mean(ratios: list[float]) -> float:
    """Return the mean of some ratios, NaN of none."""
    return float(np.mean(ratios)) if ratios else float("nan")
