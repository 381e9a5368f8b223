"""The metrics of map structure: how well sub-maps find districts, and how fast."""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.benchmark import Setting
from benchmarks.map_structure.towns import FUNCTIONS, Town, town
from benchmarks.optional import scikit_learn
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most, more_than
from cogmap.experiments.map_structure.boundaries import Boundaries
from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.public import SubMaps, SubMapsConfig

THRESHOLDS = {
    "ari": at_least(0.9),
    "ari_over_sklearn": more_than(0.0),
    "objects_10k_s": at_most(5.0),
    "incremental_ms_p99": at_most(20.0),
}
SEEDS = range(40)
ONE_AT_A_TIME = 4
CITY_SEED = 100
CITY_DISTRICTS = 45
CITY_PLOT_M = 115.0
CITY_OBJECTS = 10_000
ARRIVALS = 500
REPEATS = 3
ORDER_SEED = 7
MAX_COMPONENTS = 24
MAX_ITERATIONS = 1000

WITHOUT: Mapping[str, SubMapsConfig] = {
    "ari_without_position": SubMapsConfig(position_weight=0.0, spacing_weight=0.0),
    "ari_without_function": SubMapsConfig(function_weight=0.0),
    "ari_without_boundary": SubMapsConfig(boundary_weight=0.0),
}
"""All but one feature, by the key of their score."""


def measure(setting: Setting) -> Metrics:
    """Measure how well sub-maps find the districts of towns again, and how fast.

    Towns made up from seeds, with known districts and boundaries between most of them. The adjusted
    Rand index is compared with that of scikit-learn's Gaussian mixture with a Dirichlet-process
    prior on the same positions, which `make bench-setup` installs. Takes about two minutes.
    """
    setting.announce(f"finding the districts of {len(SEEDS)} towns")
    towns = [town(seed) for seed in SEEDS]
    config = SubMapsConfig()
    scores = []
    ratios = []
    peers = []
    for made in towns:
        labels = _settled(made, config)
        scores.append(adjusted_rand_index(made.districts, labels))
        ratios.append(len(np.unique(labels)) / len(np.unique(made.districts)))
        peers.append(adjusted_rand_index(made.districts, gaussian_mixture(made.positions_m)))

    # Objects that come one at a time, in random order.
    arriving = []
    for made in towns[:ONE_AT_A_TIME]:
        order = np.random.default_rng(ORDER_SEED).permutation(len(made.positions_m))
        sub_maps = sub_maps_of(made.select(order[:1]), config)
        sub_maps.settle()
        for index in order[1:].tolist():
            sub_maps.add(made.positions_m[index], int(made.functions[index]))
        arriving.append(adjusted_rand_index(made.districts[order], sub_maps.labels))

    metrics = {
        "ari": float(np.mean(scores)),
        "ari_worst": min(scores),
        "ari_sklearn": float(np.mean(peers)),
        "ari_over_sklearn": float(np.mean(scores) - np.mean(peers)),
        "sub_maps_over_districts": float(np.mean(ratios)),
        "ari_first": float(np.mean(scores[:ONE_AT_A_TIME])),
        "ari_first_incremental": float(np.mean(arriving)),
    }
    for key, less in WITHOUT.items():
        without = [adjusted_rand_index(made.districts, _settled(made, less)) for made in towns]
        metrics[key] = float(np.mean(without))

    setting.announce(f"a city of {CITY_OBJECTS} objects")
    return metrics | city_times()


def sub_maps_of(made: Town, config: SubMapsConfig, labels: Indices | None = None) -> SubMaps:
    """Return the objects of a town, that are in no sub-map yet, or in those that `labels` name."""
    return SubMaps(
        made.positions_m,
        made.functions,
        Boundaries(made.boundaries_m),
        config,
        kinds=FUNCTIONS,
        labels=labels,
    )


def _settled(made: Town, config: SubMapsConfig) -> Indices:
    """Cluster a town's objects at once, and return their labels (n,)."""
    sub_maps = sub_maps_of(made, config)
    sub_maps.settle()
    return sub_maps.labels


def city_times() -> Metrics:
    """Return the time of 10,000 objects at once, the least of some times, and of each of some more
    that arrive then.
    """
    city = town(CITY_SEED, CITY_DISTRICTS, CITY_PLOT_M)
    order = np.random.default_rng(ORDER_SEED).permutation(len(city.positions_m))
    there = city.select(order[:CITY_OBJECTS])
    arriving = city.select(order[CITY_OBJECTS : CITY_OBJECTS + ARRIVALS])

    took_s = []
    for _ in range(REPEATS):
        began_s = time.perf_counter()
        sub_maps = sub_maps_of(there, SubMapsConfig())
        sub_maps.settle()
        took_s.append(time.perf_counter() - began_s)

    score = adjusted_rand_index(there.districts, sub_maps.labels)
    added_ms = []
    for position_m, function in zip(arriving.positions_m, arriving.functions, strict=True):
        began_s = time.perf_counter()
        sub_maps.add(position_m, int(function))
        added_ms.append(1e3 * (time.perf_counter() - began_s))

    return {
        "objects_10k_s": min(took_s),
        "ari_10k": score,
        "incremental_ms_p50": float(np.percentile(added_ms, 50)),
        "incremental_ms_p99": float(np.percentile(added_ms, 99)),
        "incremental_ms_max": max(added_ms),
    }


def adjusted_rand_index(truth: Indices, labels: Indices) -> float:
    """Return the adjusted Rand index of two partitions (n,): 1 if they are the same, about 0 if
    they agree by chance alone.
    """
    metrics: Any = scikit_learn().metrics
    return float(metrics.adjusted_rand_score(truth, labels))


def gaussian_mixture(positions_m: Floats) -> Indices:
    """Return the (n,) labels that a Gaussian mixture with a Dirichlet-process prior gives to
    positions, (n, 2), by variational inference.
    """
    mixture: Any = scikit_learn().mixture
    model = mixture.BayesianGaussianMixture(
        n_components=min(MAX_COMPONENTS, len(positions_m)),
        weight_concentration_prior_type="dirichlet_process",
        max_iter=MAX_ITERATIONS,
        random_state=0,
    )
    with warnings.catch_warnings():
        # It warns if it has not converged after all iterations, and is taken as it is.
        warnings.simplefilter("ignore")
        labels = model.fit_predict(positions_m)

    return np.asarray(labels, np.int64)
