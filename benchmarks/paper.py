"""The paper's experiments that have a threshold, as benchmarks at their commands' own defaults."""

from __future__ import annotations

from benchmarks.benchmark import Setting
from benchmarks.report import Metrics
from benchmarks.threshold import at_most, more_than, within
from cogmap.cli.progress import bar
from cogmap.experiments.city_maps import measure as city_maps
from cogmap.experiments.city_maps.metrics import map_metrics
from cogmap.experiments.city_maps.sources import grown_environments
from cogmap.experiments.cue_integration import run as cue_integration

# Of SDs: within a quarter of those of the published simulation.
CUE_INTEGRATION_THRESHOLDS = {
    "sd_both_over_optimal": within(0.9, 1.1),
    "landmark_sd_m": within(0.30, 0.50),
    "both_sd_m": within(0.2025, 0.3375),
    "conflict_sd_m": within(0.2325, 0.3875),
    "integration_over_alternation": more_than(0),
}
CITY_MAPS_THRESHOLDS = {"error_corrected_over_uncorrected": at_most(0.25)}
SEED = 1
TRIALS = 200


def measure_cue_integration(setting: Setting) -> Metrics:
    """Measure experiment 1, as `cogmap experiment cue-integration` runs it."""
    with bar("trials") as progress:
        budget = cue_integration.Budget(TRIALS, SEED, setting.processes, progress)
        outcome = cue_integration.measure(cue_integration.FITTED, budget)

    return outcome.metrics()


def measure_city_maps(setting: Setting) -> Metrics:
    """Measure experiment 2, as `cogmap experiment city-maps` runs it: cities grown from seeds."""
    places = grown_environments(city_maps.MAPS, SEED)

    with bar("traversals") as progress:
        budget = city_maps.Budget(city_maps.TRAVERSALS, SEED, setting.processes, progress)
        maps = city_maps.measure(places, city_maps.NOISE, budget)

    metrics: Metrics = {}
    for key, value in map_metrics(maps, city_maps.NOISE).items():
        if isinstance(value, float):
            metrics[key] = value

    return metrics
