"""The metrics of map correction on one pose graph."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.map_correction.reference import Gtsam, best_positions
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from benchmarks.trajectory import trajectory_error_m
from cogmap.cli.log.progress import bar
from cogmap.data import pose_graph
from cogmap.data.pose_graph import read_true_positions
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from cogmap.services.codelets.correction.incremental import IncrementalSolver
from cogmap.services.codelets.correction.least_squares import optimize
from cogmap.services.codelets.correction.pose_graph import Constraints, PoseGraph, cost
from cogmap.services.codelets.correction.reverse_replay import (
    close_loops,
    displacements,
    position_cost,
)

THRESHOLDS = {
    "positions_cost_ratio": at_most(1.05),
    "ate_vs_gtsam": at_most(1.10),
    "time_vs_gtsam": at_most(1.0),
    "incremental_ms_p99": at_most(20.0),
}
# A sum of squared, whitened errors below which two solutions are the same: rounding.
SAME_COST = 1e-9
PAIRS = 7
MAX_NEW_CLOSURES = 200
MAX_HELD_OUT_SHARE = 0.5
RELINEARIZE_EVERY = 20
SEED = 4
T = TypeVar("T")


def measure(graph_path: Path, truth_path: Path | None) -> Metrics:
    """The metrics of THRESHOLDS, and others that explain them; errors only where there is a truth.

    Raises UsageError where a file cannot be read, or gtsam or evo is not installed.
    """
    graph = read_graph(graph_path)
    truth_m = read_truth(truth_path, graph_path, len(graph.poses))
    peer = Gtsam(graph.poses, graph.constraints)

    metrics = {
        "poses": float(len(graph.poses)),
        "closures": float(len(graph.closures)),
    }
    positions_m, of_positions = _positions(graph)
    poses, peers_poses, of_headings = _headings(graph, peer)
    metrics |= of_positions | of_headings

    if truth_m is not None:
        paths_m = {
            "ate_uncorrected_m": graph.poses[:, :2],
            "ate_positions_m": positions_m,
            "ate_m": poses[:, :2],
            "ate_gtsam_m": peers_poses[:, :2],
        }
        metrics |= _trajectory_errors(paths_m, truth_m)

    batch_cost = cost(poses, graph.constraints)
    return metrics | _incremental(graph, batch_cost)


def _trajectory_errors(paths_m: Mapping[str, Floats], truth_m: Floats) -> Metrics:
    """Each path's absolute trajectory error by its key, and ours over gtsam's."""
    errors_m = {}
    for key, path_m in paths_m.items():
        errors_m[key] = trajectory_error_m(path_m, truth_m)

    ratio = errors_m["ate_m"] / errors_m["ate_gtsam_m"]
    return errors_m | {"ate_vs_gtsam": ratio}


def read_graph(path: Path) -> PoseGraph:
    """Read the pose graph in a file. Raises UsageError if it cannot be read."""
    file = pose_graph.read(path)
    constraints = Constraints(file.i, file.j, file.measurement, file.information)
    return PoseGraph.of(file.poses, constraints)


def cost_ratio(cost: float, reference: float) -> float:
    """Return the one cost over the other; 1 if both are rounding, as in a graph without loops."""
    return (cost + SAME_COST) / (reference + SAME_COST)


def read_truth(path: Path | None, graph_path: Path, count: int) -> Floats | None:
    if path is None:
        return None

    truth_m = read_true_positions(path)
    if len(truth_m) != count:
        raise UsageError(f"{path} has {len(truth_m)} poses, {graph_path} has {count}")

    return truth_m


def _positions(graph: PoseGraph) -> tuple[Floats, Metrics]:
    """By the paper's rule, positions only, against exact least squares."""
    took_s, found = _timed(partial(close_loops, graph))
    constraints = graph.constraints
    known = displacements(graph.poses, constraints)
    min_cost = position_cost(best_positions(graph), constraints, known)

    found_cost = position_cost(found.positions_m, constraints, known)

    metrics = {
        "positions_cost_ratio": cost_ratio(found_cost, min_cost),
        "positions_replays": float(found.replays),
        "positions_ms": 1e3 * took_s,
    }
    return found.positions_m, metrics


def _headings(graph: PoseGraph, peer: Gtsam) -> tuple[Floats, Floats, Metrics]:
    """Both from the same poses, each once to warm up, then in turn; each one's median time."""
    by_qr = peer.gives_up()
    poses = optimize(graph)
    peers_poses = peer.poses(peer.solve())
    ours_s, peers_s = _in_turn(graph, peer)

    heading_cost = cost(poses, graph.constraints)
    peers_cost = cost(peers_poses, graph.constraints)
    metrics = {
        "heading_ms": 1e3 * ours_s,
        "gtsam_ms": 1e3 * peers_s,
        "gtsam_by_qr": float(by_qr),
        "time_vs_gtsam": ours_s / peers_s,
        "heading_cost": heading_cost,
        "cost_vs_gtsam": cost_ratio(heading_cost, peers_cost),
    }
    return poses, peers_poses, metrics


def _in_turn(graph: PoseGraph, peer: Gtsam) -> tuple[float, float]:
    """The median seconds of PAIRS runs of ours and of gtsam's."""
    ours_s = []
    peers_s = []

    with bar("correcting headings, and gtsam the same") as progress:
        for pair in range(1, PAIRS + 1):
            our_s, _ = _timed(partial(optimize, graph))
            peer_s, _ = _timed(peer.solve)
            ours_s.append(our_s)
            peers_s.append(peer_s)
            progress(pair / PAIRS)

    return float(np.median(ours_s)), float(np.median(peers_s))


def _incremental(graph: PoseGraph, batch_cost: float) -> Metrics:
    """Closures left out at random are added one at a time.

    Relinearizing, which happens between two closures, is timed apart.
    """
    closures = len(graph.closures)
    count = min(MAX_NEW_CLOSURES, int(MAX_HELD_OUT_SHARE * closures))
    if not count:
        return {}

    order = np.random.default_rng(SEED).permutation(closures)
    held_out = order[:count]
    rest = np.setdiff1d(np.arange(closures), held_out)
    known = graph.closures.select(rest)
    solver = IncrementalSolver(PoseGraph(graph.poses, graph.steps, known))
    added_ms, relinearized_ms = _add_each(solver, graph.closures, held_out.tolist())

    final_cost = cost(solver.graph.poses, solver.graph.constraints)
    return {
        "incremental_ms_p50": float(np.percentile(added_ms, 50)),
        "incremental_ms_p99": float(np.percentile(added_ms, 99)),
        "incremental_ms_max": max(added_ms),
        "incremental_cost_ratio": cost_ratio(final_cost, batch_cost),
        "incremental_closures": float(count),
        "settle_ms_p50": float(np.median(relinearized_ms or [0.0])),
    }


def _add_each(
    solver: IncrementalSolver, closures: Constraints, indices: Sequence[int]
) -> tuple[list[float], list[float]]:
    """Add one closure after the other: the times of adding, and those of relinearizing, in ms."""
    added_ms = []
    relinearized_ms = []

    with bar("closing one more loop") as progress:
        for number, index in enumerate(indices, start=1):
            closure = closures.select(np.array([index]))
            add_s, _ = _timed(partial(solver.add, closure))
            added_ms.append(1e3 * add_s)

            if number % RELINEARIZE_EVERY == 0:
                relinearize_s, _ = _timed(solver.relinearize)
                relinearized_ms.append(1e3 * relinearize_s)

            progress(number / len(indices))

    return added_ms, relinearized_ms


def _timed(work: Callable[[], T]) -> tuple[float, T]:
    """The seconds that `work` took, and what it returned."""
    began_s = time.perf_counter()
    result = work()
    return time.perf_counter() - began_s, result
