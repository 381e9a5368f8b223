"""The metrics of individuals: whether each building is one object of the map, where it stands."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click
import numpy as np

from benchmarks.benchmark import PROCESSES, Setting, path_option
from benchmarks.individuals.names import SURE, sure_right_share
from benchmarks.individuals.town import Houses, Town, Visit, visit
from benchmarks.individuals.visitor import Plan
from benchmarks.perception.objects import calibration_error
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most, within
from cogmap.cli.launch.individuals.judge import BuildingMetrics
from cogmap.cli.progress import bar
from cogmap.parallel import parallel_map

TOWNS = 10
FIRST_SEED = 8601
EXPLORE_S = 180.0
GOALS = 10
DRIVE_S = 600.0
PLANS = {
    Houses.NEVER_TAUGHT: Plan(EXPLORE_S, GOALS, DRIVE_S),
    Houses.MIXED: Plan(EXPLORE_S),
    Houses.EQUAL: Plan(EXPLORE_S, least_s=DRIVE_S),
}
ONE_EACH = within(0.95, 1.05)
THRESHOLDS = {
    "individuals_per_building": ONE_EACH,
    "right_share": at_least(0.95),
    "error_median_m": at_most(1.2),
    "percept_purity": at_least(0.97),
    "sure_right_share": at_least(0.97),
    "ece": at_most(0.05),
    "goals_reached_share": at_least(0.97),
    "error_over_fused": at_most(0.5),
    "equal_individuals_per_building": ONE_EACH,
    "wrong_closures": at_most(0),
}

OPTIONS = (
    click.Option(
        ["--towns"],
        type=click.IntRange(1, 1000),
        default=TOWNS,
        show_default=True,
        help="How many of each kind; the metrics are of all.",
    ),
    click.Option(
        ["--first-seed"],
        type=click.IntRange(0, 2**31),
        default=FIRST_SEED,
        show_default=True,
        help="Seed of the first town. Develop with others than these.",
    ),
    path_option(
        "--keep",
        "folder",
        metavar="DIR",
        text="Keep the logs of all towns there, without pictures, for `cogmap log`.",
    ),
    PROCESSES,
)


def measure(
    setting: Setting,
    *,
    towns: int = TOWNS,
    first_seed: int = FIRST_SEED,
    folder: Path | None = None,
) -> Metrics:
    """Measure whether an agent knows each building as one individual, where it stands, and finds it
    again by its name.

    It explores ten towns of blocks for three minutes with cameras. Nobody was taught any of their
    buildings. Then it drives to ten buildings of each by the names that it has given them; its
    error is compared with that of fused self-motion alone over the first ten minutes. The names
    that perception was taught are judged in ten towns more, where three in ten buildings have one.
    Ten minutes in towns of equal houses in two looks follow, at the level of percepts. Takes some
    four hours on two cores.
    """
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)

    # The longest come first.
    visits = []
    for houses, plan in PLANS.items():
        for seed in range(first_seed, first_seed + towns):
            log = None if folder is None else folder / f"{houses}-{seed}.mcap"
            visits.append(Visit(seed, houses, plan, log))

    with bar("towns") as progress:
        found = parallel_map(visit, visits, setting.processes, progress)

    for town in found:
        setting.announce(sentence(town))
    return metrics(found)


def sentence(town: Town) -> str:
    """Tell in a line what one town gave."""
    explored = town.explored
    return (
        f"{town.visit.houses} {town.visit.seed}: {explored.on_map} objects for {explored.seen} "
        f"buildings, {explored.right} of them right; {town.drive_s:.0f} s driven in "
        f"{town.wall_s:.0f} s"
    )


def metrics(towns: Sequence[Town]) -> Metrics:
    """Add up the towns of each kind; ratios are of the sums, medians and errors are means of the
    towns'.
    """
    strange, mixed, equal = (
        [town for town in towns if town.visit.houses is houses] for houses in PLANS
    )
    explored = [town.explored for town in strange]
    reached = [is_reached for town in strange for is_reached in town.reached]
    names = [name for town in mixed for name in town.names]
    strange_names = [name for town in strange for name in town.names]
    over_fused = [town.estimate_m / town.fused_m for town in strange]
    of_equal = on_map([town.explored for town in equal])
    of_mixed = on_map([town.explored for town in mixed])
    return on_map(explored) | {
        "sure_right_share": sure_right_share(names),
        "ece": calibration_error(names),
        "goals_reached_share": _share(sum(reached), len(reached)),
        "error_over_fused": float(np.mean(over_fused)),
        "equal_individuals_per_building": of_equal["individuals_per_building"],
        "wrong_closures": float(sum(town.wrong_closures for town in equal)),
        "estimate_error_m": float(np.mean([town.estimate_m for town in strange])),
        "fused_error_m": float(np.mean([town.fused_m for town in strange])),
        "cameras_closures": float(sum(town.closures for town in strange)),
        "cameras_wrong_closures": float(sum(town.wrong_closures for town in strange)),
        "taught_names": float(len(names)),
        "strangers_surely_named": float(sum(activation > SURE for activation, _ in strange_names)),
        "mixed_individuals_per_building": of_mixed["individuals_per_building"],
        "mixed_right_share": of_mixed["right_share"],
        "mixed_percept_purity": of_mixed["percept_purity"],
        "equal_right_share": of_equal["right_share"],
        "equal_percept_purity": of_equal["percept_purity"],
        "equal_closures": float(sum(town.closures for town in equal)),
        "town_wall_s": float(np.mean([town.wall_s for town in strange])),
    }


def on_map(towns: Sequence[BuildingMetrics]) -> Metrics:
    """Return the metrics of the buildings on the maps of some towns."""
    seen = sum(town.seen for town in towns)
    objects = sum(town.on_map for town in towns)
    given = sum(town.given for town in towns)
    medians_m = [town.error_median_m for town in towns if town.error_median_m is not None]
    return {
        "individuals_per_building": _share(objects, seen),
        "right_share": _share(sum(town.right for town in towns), objects),
        "error_median_m": float(np.mean(medians_m)) if medians_m else float("nan"),
        "percept_purity": _share(sum(town.pure for town in towns), given),
        "buildings": float(seen),
        "missing_share": _share(sum(town.missing for town in towns), seen),
        "doubled_share": _share(sum(town.doubled for town in towns), seen),
        "stray_share": _share(sum(town.strays for town in towns), objects),
        "percepts_given_share": _share(given, sum(town.percepts for town in towns)),
    }


def _share(part: int, whole: int) -> float:
    """Return a share, NaN of nothing."""
    return part / whole if whole else float("nan")
