"""The metrics of map correction on one pose graph."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click
import numpy as np

from benchmarks.benchmark import PROCESSES, Setting, path_option
from benchmarks.map_correction import false_groups
from benchmarks.map_correction.files import read_graph, read_truth
from benchmarks.map_correction.reference import Gtsam, best_positions
from benchmarks.optional import trajectory_error_m
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from benchmarks.timing import timed
from cogmap.cli.progress import bar
from cogmap.estimation.incremental import IncrementalSolver
from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import PoseGraph, cost
from cogmap.estimation.reverse_replay import (
    close_loops,
    displacements,
    position_cost,
)
from cogmap.geometry.arrays import Floats

THRESHOLDS = {
    "positions_cost_ratio": at_most(1.05),
    "ate_vs_gtsam": at_most(1.10),
    "time_vs_gtsam": at_most(1.0),
    "incremental_ms_p99": at_most(20.0),
}
OPTIONS = (
    path_option(
        "--graph",
        "graph_path",
        required=True,
        metavar="FILE",
        text="A pose graph in the plane of yours: .g2o, or TORO's .graph; packed or not.",
    ),
    path_option(
        "--truth",
        "truth_path",
        metavar="FILE",
        text="Its true poses, a line each: x, y and heading, with an index before them or not.",
    ),
    click.Option(
        ["--false-groups", "has_false_groups"],
        is_flag=True,
        help="Add false closures, alone and in groups that agree, and tell which are believed.",
    ),
    PROCESSES,
)
PAIRS = 7
# A sum of squared, whitened residuals that is rounding: two solutions below it are the same.
SAME_COST = 1e-9
MAX_NEW_CLOSURES = 200
MAX_HELD_OUT_SHARE = 0.5
RELINEARIZE_EVERY = 20
SEED = 4


def measure(
    setting: Setting,
    *,
    graph_path: Path,
    truth_path: Path | None = None,
    has_false_groups: bool = False,
) -> Metrics:
    """Measure how well and how fast loops are closed, on a pose graph that was recorded elsewhere.

    By the paper's rule, for positions only, against exact least squares; with headings too, against
    gtsam, which `make bench-setup` installs; and one closure at a time. Takes up to half a minute.
    With --false-groups instead: 10, 50 and 100 false closures, alone and in groups of 3 and 5; the
    errors that they cause are measured if there is a --truth. Takes some minutes.
    """
    graph = read_graph(graph_path)
    if has_false_groups:
        return false_groups.measure(graph, graph_path, truth_path, setting.processes)

    truth_m = read_truth(truth_path, graph_path, len(graph.poses))
    peer = Gtsam(graph.poses, graph.constraints)

    metrics = {
        "poses": float(len(graph.poses)),
        "closures": float(len(graph.closures)),
    }
    positions_m, of_positions = _correct_positions(graph)
    poses, peers_poses, of_headings = _correct_headings(graph, peer)
    metrics |= of_positions | of_headings

    if truth_m is not None:
        paths_m = {
            "ate_uncorrected_m": graph.poses[:, :2],
            "ate_positions_m": positions_m,
            "ate_m": poses[:, :2],
            "ate_gtsam_m": peers_poses[:, :2],
        }
        metrics |= {key: trajectory_error_m(path_m, truth_m) for key, path_m in paths_m.items()}
        metrics["ate_vs_gtsam"] = metrics["ate_m"] / metrics["ate_gtsam_m"]

    batch_cost = cost(poses, graph.constraints)
    return metrics | _add_closures(graph, batch_cost)


def cost_ratio(found: float, reference: float) -> float:
    """Return the one cost over the other; 1 if both are rounding, as in a graph without loops."""
    return (found + SAME_COST) / (reference + SAME_COST)


def _correct_positions(graph: PoseGraph) -> tuple[Floats, Metrics]:
    """Correct positions only, by the paper's rule, against exact least squares."""
    took_s, found = timed(partial(close_loops, graph))
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


def _correct_headings(graph: PoseGraph, peer: Gtsam) -> tuple[Floats, Floats, Metrics]:
    """Solve both ways from the same poses: once to warm up, then in turn; take the median times."""
    by_qr = peer.gives_up()
    poses = optimize(graph)
    peers_poses = peer.poses(peer.solve())

    took_s = []
    with bar("correcting headings, and gtsam the same") as progress:
        for pair in range(1, PAIRS + 1):
            our_s, _ = timed(partial(optimize, graph))
            peer_s, _ = timed(peer.solve)
            took_s.append((our_s, peer_s))
            progress(pair / PAIRS)

    ours_s, peers_s = np.median(took_s, axis=0).tolist()
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


def _add_closures(graph: PoseGraph, batch_cost: float) -> Metrics:
    """Add closures that were left out at random, one at a time.

    Relinearizing, which happens between two closures, is timed apart.
    """
    closures = len(graph.closures)
    count = min(MAX_NEW_CLOSURES, int(MAX_HELD_OUT_SHARE * closures))
    if not count:
        return {}

    held_out = np.random.default_rng(SEED).permutation(closures)[:count]
    rest = np.setdiff1d(np.arange(closures), held_out)
    solver = IncrementalSolver(PoseGraph(graph.poses, graph.steps, graph.closures.select(rest)))
    added_ms = []
    relinearized_ms = []

    with bar("closing one more loop") as progress:
        for number, index in enumerate(held_out.tolist(), start=1):
            closure = graph.closures.select(np.array([index]))
            add_s, _ = timed(partial(solver.add, closure))
            added_ms.append(1e3 * add_s)

            if number % RELINEARIZE_EVERY == 0:
                relinearize_s, _ = timed(solver.relinearize)
                relinearized_ms.append(1e3 * relinearize_s)

            progress(number / count)

    final_cost = cost(solver.graph.poses, solver.graph.constraints)
    return {
        "incremental_ms_p50": float(np.percentile(added_ms, 50)),
        "incremental_ms_p99": float(np.percentile(added_ms, 99)),
        "incremental_ms_max": max(added_ms),
        "incremental_cost_ratio": cost_ratio(final_cost, batch_cost),
        "incremental_closures": float(count),
        "settle_ms_p50": float(np.median(relinearized_ms or [0.0])),
    }
