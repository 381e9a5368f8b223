"""False loop closures, alone and in groups that agree with one another, and what they do to a map.

A group is what two streets that look alike give: closures from successive places to successive
places, each the one that path integration makes of the first.
"""

from __future__ import annotations

from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.map_correction.files import read_truth
from benchmarks.optional import trajectory_error_m
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.cli.progress import bar
from cogmap.errors import UsageError
from cogmap.estimation.gnc import inliers
from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import Constraints, PoseGraph
from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import compose, integrate, relative
from cogmap.parallel import parallel_map
from cogmap.services.codelets.public import FALSE_CLOSURE

THRESHOLDS = {
    "ate_ratio": at_most(1.1),
    "true_kept": at_least(0.95),
}
COUNTS = (10, 50, 100)
SIZES = (1, 3, 5)
MIN_APART = 100
POSITION_M = 1.0
HEADING_SD_RAD = 0.05
SEED = 7
Groups = tuple[int, int]


def measure(graph: PoseGraph, graph_path: Path, truth_path: Path | None, processes: int) -> Metrics:
    """Return the worst of each metric over all counts of false closures and sizes of groups, and
    each one's. Errors are measured if there is a truth.

    Raises UsageError if the graph is too short, or evo is not installed.
    """
    if len(graph.poses) < 2 * MIN_APART:
        raise UsageError(f"{graph_path} has {len(graph.poses)} poses: give one of {2 * MIN_APART}")

    truth_m = read_truth(truth_path, graph_path, len(graph.poses))
    without = optimize(graph)

    settings = list(product(COUNTS, SIZES))
    work = partial(_kept, graph=graph)
    with bar("judging false closures") as progress:
        kept = parallel_map(work, settings, processes, progress)

    metrics: Metrics = {}
    ratios = []
    true_shares = []
    for (count, size), (is_kept, poses) in zip(settings, kept, strict=True):
        of_true, of_false = np.split(is_kept, [len(graph.closures)])
        name = f"{count}_by_{size}"
        true_shares.append(float(of_true.mean()))
        metrics[f"true_kept_{name}"] = true_shares[-1]
        metrics[f"false_kept_{name}"] = float(of_false.sum())

        if truth_m is not None:
            error_m = trajectory_error_m(poses[:, :2], truth_m)
            ratios.append(error_m / trajectory_error_m(without[:, :2], truth_m))
            metrics[f"ate_ratio_{name}"] = ratios[-1]

    if ratios:
        metrics["ate_ratio"] = max(ratios)
    return metrics | {"true_kept": min(true_shares)}


def _kept(groups: Groups, graph: PoseGraph) -> tuple[Booleans, Floats]:
    """Return the mask of inliers, the graph's own before the false ones, and the path by them."""
    count, size = groups
    rng = np.random.default_rng([SEED, count, size])
    closures = graph.closures + false_closures(graph, count, size, rng)

    # As they come to light on the way: the graph's own are not the first.
    ends = np.maximum(closures.i, closures.j)
    order = np.lexsort((closures.i, ends))
    in_order = graph.with_closures(closures.select(order))

    is_kept = np.zeros(len(closures), bool)
    is_kept[order] = inliers(in_order, FALSE_CLOSURE)
    poses = optimize(graph.with_closures(closures.select(is_kept)))
    return is_kept, poses


def false_closures(
    graph: PoseGraph, count: int, size: int, rng: np.random.Generator
) -> Constraints:
    """Draw `count` false closures in groups of `size` that agree, as certain as the graph's own."""
    path = integrate(np.zeros(3), graph.steps.measurement)
    rows: list[tuple[int, int, Floats]] = []
    while len(rows) < count:
        first, later = sorted(rng.integers(0, len(path) - size, 2).tolist())
        if later - first < MIN_APART:
            continue

        # The later places seem to be the first ones, from one side or the other.
        turned_rad = rng.choice([0.0, np.pi]) + rng.normal(0.0, HEADING_SD_RAD)
        seen = np.array([*rng.uniform(-POSITION_M, POSITION_M, 2), turned_rad])
        for step in range(min(size, count - len(rows))):
            since_first = relative(path[first], path[first + step])
            since_later = relative(path[later], path[later + step])
            measured = relative(since_first, compose(seen, since_later))
            rows.append((first + step, later + step, measured))

    i, j, measurement = zip(*rows, strict=True)
    typical = np.median(graph.closures.information, axis=0)
    return Constraints(
        i=np.array(i),
        j=np.array(j),
        measurement=np.array(measurement),
        information=np.repeat(typical[None], count, axis=0),
    )
