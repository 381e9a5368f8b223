"""Sub-maps of a city, and what can be stated of them: nobody knows the true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from cogmap.experiments.map_structure.boundaries import Boundaries
from cogmap.experiments.map_structure.city import UNKNOWN, StructuredCity
from cogmap.experiments.map_structure.functions import FUNCTIONS
from cogmap.geometry.arrays import Floats, Indices
from cogmap.parallel import Progress, parallel_map
from cogmap.services.codelets.sub_maps.config import Config
from cogmap.services.codelets.sub_maps.neighbours import neighbours
from cogmap.services.codelets.sub_maps.sub_maps import SubMaps

NOISE_SD_M = 2.0
REPEATS = 5
CLEARANCE_M = 1.0
MAX_COMPARED = 3000


@dataclass(frozen=True, eq=False)
class Structured:
    """A city, and the sub-map of each of its objects, (n,), from 0; `repeats` (r, n) are those of
    the same objects at positions with noise.
    """

    city: StructuredCity
    labels: Indices
    repeats: Indices

    @property
    def count(self) -> int:
        """Return how many sub-maps there are."""
        return len(np.unique(self.labels))


@dataclass(frozen=True)
class Job:
    """A city, and the seed of the noise on its positions."""

    city: StructuredCity
    seed: int


def measure(
    cities: Sequence[StructuredCity], seed: int, processes: int, progress: Progress
) -> list[Structured]:
    """Return the sub-maps of each city."""
    jobs = [Job(city, seed) for city in cities]
    return parallel_map(structured, jobs, processes, progress)


def structured(job: Job) -> Structured:
    """Return the sub-maps of one city, by all features and the weights that the system runs
    with.
    """
    city = job.city
    rng = np.random.default_rng([job.seed, 0x5B])
    repeats = []
    for _ in range(REPEATS):
        noise_m = rng.normal(0.0, NOISE_SD_M, city.positions_m.shape)
        noisy = replace(city, positions_m=city.positions_m + noise_m)
        repeats.append(_labels(noisy))

    return Structured(city, _labels(city), np.array(repeats))


def metrics_of(found: Sequence[Structured]) -> dict[str, float | str]:
    """Return what is reported of each city, by keys that begin with its name."""
    metrics: dict[str, float | str] = {}
    for each in found:
        for key, value in _metrics(each).items():
            metrics[f"{each.city.name}_{key}"] = value

    return metrics


def adjusted_rand_index(first: Indices, second: Indices) -> float:
    """Return the adjusted Rand index of two partitions (n,) (Hubert and Arabie 1985): 1 if they are
    the same, about 0 if they agree by chance alone.
    """
    _, row = np.unique(first, return_inverse=True)
    _, column = np.unique(second, return_inverse=True)
    shared = np.zeros((row.max() + 1, column.max() + 1))
    np.add.at(shared, (row, column), 1.0)

    in_both = _pairs(shared).sum()
    in_first = _pairs(shared.sum(axis=1)).sum()
    in_second = _pairs(shared.sum(axis=0)).sum()
    by_chance = in_first * in_second / max(1.0, float(_pairs(np.array(float(len(row))))))
    most = (in_first + in_second) / 2
    if most == by_chance:
        return 1.0

    return float((in_both - by_chance) / (most - by_chance))


def _pairs(counts: Floats) -> Floats:
    pairs: Floats = counts * (counts - 1) / 2
    return pairs


def _labels(city: StructuredCity) -> Indices:
    sub_maps = SubMaps(
        city.positions_m,
        city.functions,
        Boundaries(city.boundaries_m),
        Config(),
        kinds=len(FUNCTIONS),
        clear_m=city.half_widths_m + CLEARANCE_M,
    )
    sub_maps.settle()
    return sub_maps.labels


def _metrics(found: Structured) -> dict[str, float]:
    city = found.city
    sizes = np.unique(found.labels, return_counts=True)[1]
    areas_ha = []
    for label in range(found.count):
        width_m, height_m = np.ptp(city.positions_m[found.labels == label], axis=0).tolist()
        areas_ha.append(width_m * height_m / 1e4)
    stable = [adjusted_rand_index(found.labels, repeat) for repeat in found.repeats]

    metrics = {
        "objects": float(len(city.positions_m)),
        "function_known_share": float(np.mean(city.functions != UNKNOWN)),
        "sub_maps": float(found.count),
        "objects_a_sub_map_median": float(np.median(sizes)),
        "objects_a_sub_map_largest": float(sizes.max()),
        "area_median_ha": float(np.median(areas_ha)),
        "silhouette": _silhouette(city.positions_m, found.labels),
        "same_with_noise": float(np.mean(stable)),
        **_separation(found),
    }
    if len(city.places_m) > 1:
        nearest = cKDTree(city.places_m).query(city.positions_m)[1]
        metrics["agreement_with_named_places"] = adjusted_rand_index(found.labels, nearest)
        metrics["named_places"] = float(len(city.places_m))

    return metrics


def _separation(found: Structured) -> dict[str, float]:
    """Return how often a boundary is between neighbours of one sub-map, and of two."""
    city = found.city
    edges = neighbours(city.positions_m)
    clear_m = (city.half_widths_m + CLEARANCE_M)[edges]
    is_crossed = Boundaries(city.boundaries_m).are_crossed(city.positions_m[edges], clear_m)

    is_within = found.labels[edges[:, 0]] == found.labels[edges[:, 1]]
    separation = {"crossed_within_share": float(is_crossed[is_within].mean())}
    if not is_within.all():
        separation["crossed_between_share"] = float(is_crossed[~is_within].mean())

    return separation


def _silhouette(positions_m: Floats, labels: Indices) -> float:
    """Return the mean silhouette by distance (Rousseeuw 1987), of at most MAX_COMPARED objects,
    evenly chosen; 0 if there is one sub-map.
    """
    step = -(-len(labels) // MAX_COMPARED)
    positions_m = positions_m[::step]
    names, labels = np.unique(labels[::step], return_inverse=True)
    if len(names) < 2:
        return 0.0

    belongs = labels[:, None] == np.arange(len(names))
    sizes = belongs.sum(axis=0)
    summed_m = cdist(positions_m, positions_m) @ belongs
    own = np.arange(len(labels)), labels

    own_m = summed_m[own] / np.maximum(sizes[labels] - 1, 1)
    mean_m = summed_m / sizes
    mean_m[own] = np.inf
    nearest_m = mean_m.min(axis=1)

    silhouettes = (nearest_m - own_m) / np.maximum(nearest_m, own_m)
    silhouettes[sizes[labels] == 1] = 0.0
    return float(silhouettes.mean())
