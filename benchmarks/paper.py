"""The paper's experiments that have a threshold, as benchmarks at their commands' own defaults."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from benchmarks.benchmark import Setting
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most, more_than, within
from cogmap.cli.experiment.ablation import SEEDS as ABLATION_SEEDS
from cogmap.cli.experiment.ablation import domains
from cogmap.cli.experiment.city_maps import TRAVERSALS_OF_ALL
from cogmap.cli.progress import bar
from cogmap.errors import UsageError
from cogmap.experiments.ablation import measure as ablation
from cogmap.experiments.ablation.metrics import ablation_metrics
from cogmap.experiments.city_maps import measure as city_maps
from cogmap.experiments.city_maps.environment import Environment, environments
from cogmap.experiments.city_maps.fit import fitted, halves
from cogmap.experiments.city_maps.metrics import fit_metrics, map_metrics
from cogmap.experiments.city_maps.sources import folder, grown_environments
from cogmap.experiments.cue_integration import run as cue_integration

# Of SDs: within a quarter of those of the published simulation.
CUE_INTEGRATION_THRESHOLDS = {
    "sd_both_over_optimal": within(0.95, 1.05),
    "sd_both_over_optimal_within_share": at_least(0.9),
    "landmark_sd_m": within(0.30, 0.50),
    "both_sd_m": within(0.2025, 0.3375),
    "conflict_sd_m": within(0.2325, 0.3875),
    "integration_over_alternation": more_than(0),
}
PEOPLE_THRESHOLDS = {"paper_over_people": within(0.5, 2.0), "ours_over_paper": at_most(0.25)}
CITY_MAPS_THRESHOLDS = {"error_corrected_over_uncorrected": at_most(0.25)}
SEED = 1
TRIALS = 200
SEEDS = 20


def measure_cue_integration(setting: Setting) -> Metrics:
    """Measure experiment 1, as `cogmap experiment cue-integration --seeds 20` runs it."""
    with bar("trials") as progress:
        budget = cue_integration.Budget(TRIALS, SEED, setting.processes, progress)
        outcomes = cue_integration.measure_seeds(cue_integration.FITTED, budget, SEEDS)

    return cue_integration.metrics_of_seeds(outcomes, SEED)


def measure_city_maps(setting: Setting) -> Metrics:
    """Measure experiment 2, as `cogmap experiment city-maps` runs it: cities grown from seeds."""
    places = grown_environments(city_maps.MAPS, SEED)

    with bar("traversals") as progress:
        budget = city_maps.Budget(city_maps.TRAVERSALS, SEED, setting.processes, progress)
        maps = city_maps.measure(places, city_maps.NOISE, budget)

    return _numbers(map_metrics(maps, city_maps.NOISE))


def measure_against_people(setting: Setting, cities: Path) -> Metrics:
    """Measure experiment 2 on real streets, as `cogmap experiment city-maps --all` runs it: noise
    fitted to people's errors on half of the cities, measured on the others.
    """
    to, places = halves(street_environments(cities, SEED))
    with bar("fitting the noise") as progress:
        fits = fitted(to, places, SEED, progress)
    noise = fits["view"].noise

    with bar("traversals") as progress:
        budget = city_maps.Budget(TRAVERSALS_OF_ALL, SEED, setting.processes, progress)
        maps = city_maps.measure(places, noise, budget)

    return _numbers(map_metrics(maps, noise) | fit_metrics(maps, fits, len(to)))


def street_environments(cities: Path, seed: int) -> list[Environment]:
    """Return an environment of each city in a folder; those that are too small are left out."""
    found = []
    for city in folder(cities, seed):
        with suppress(UsageError):
            found += environments(city, 1, seed)

    return found


def measure_ablation(setting: Setting) -> Metrics:
    """Measure what each rule gains, as `cogmap experiment ablation` does."""
    chosen = domains(range(SEED, SEED + ABLATION_SEEDS), None, None)
    with bar("drives") as progress:
        measured = ablation.measure(chosen, setting.processes, progress)

    return _numbers(ablation_metrics(chosen, measured))


def _numbers(metrics: Mapping[str, object]) -> Metrics:
    """Return those of the metrics that are numbers."""
    return {key: value for key, value in metrics.items() if isinstance(value, float)}
