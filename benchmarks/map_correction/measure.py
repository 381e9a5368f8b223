"""The figures of map correction on one pose graph."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from rich.progress import track

from benchmarks.map_correction.reference import Gtsam, best_positions
from benchmarks.threshold import at_most
from cogmap.data.g2o import read_g2o
from cogmap.data.pose_graph import PoseGraphFile, read_true_positions
from cogmap.data.toro import read_toro
from cogmap.errors import MessageError, UsageError
from cogmap.geometry.arrays import Floats
from services.codelets.correction.incremental import IncrementalSolver
from services.codelets.correction.least_squares import optimize
from services.codelets.correction.pose_graph import Constraints, PoseGraph, cost
from services.codelets.correction.reverse_replay import close_loops, displacements, position_cost

THRESHOLDS = {
    "positions_cost_ratio": at_most(1.05),
    "ate_vs_gtsam": at_most(1.10),
    "time_vs_gtsam": at_most(1.0),
    "incremental_ms_p99": at_most(20.0),
}
READERS = {".g2o": read_g2o, ".graph": read_toro, ".toro": read_toro}
PAIRS = 7
NEW_CLOSURES = 200
HELD_OUT_AT_MOST = 0.5
SETTLE_EVERY = 20
SEED = 4
T = TypeVar("T")


def read_graph(path: Path) -> PoseGraph:
    """The path of a pose graph file, its kind told by its name. Raises UsageError where it cannot
    be read.
    """
    suffix = Path(path.stem).suffix if path.suffix == ".xz" else path.suffix
    if suffix not in READERS:
        raise UsageError(f"{path} is none of {', '.join(READERS)}, or one of them packed as .xz")
    file: PoseGraphFile = READERS[suffix](path)
    constraints = Constraints(file.i, file.j, file.measurement, file.information)
    try:
        return PoseGraph.of(file.poses, constraints)
    except MessageError as error:
        raise UsageError(f"{path}: {error}") from None


def trajectory_error_m(positions_m: Floats, truth_m: Floats) -> float:
    """Root mean square distance of (n, 2) positions from the true ones, once turned and moved to
    fit them best.
    """
    found = positions_m - positions_m.mean(axis=0)
    true = truth_m - truth_m.mean(axis=0)
    left, _, right = np.linalg.svd(found.T @ true)
    turn = left @ np.diag([1.0, np.linalg.det(left @ right)]) @ right
    return float(np.sqrt(np.square(found @ turn - true).sum(axis=1).mean()))


def measure(graph_path: Path, truth_path: Path | None) -> dict[str, float]:
    """Every figure of THRESHOLDS, and others that tell how it came about; errors only where there is a
    truth.
    """
    graph = read_graph(graph_path)
    truth_m = None if truth_path is None else read_true_positions(truth_path)
    if truth_m is not None and len(truth_m) != len(graph.poses):
        raise UsageError(
            f"{truth_path} has {len(truth_m)} poses, {graph_path} has {len(graph.poses)}"
        )
    peer = Gtsam(graph.poses, graph.constraints)
    figures = {"poses": float(len(graph.poses)), "closures": float(len(graph.closures))}
    positions_m, told = _positions(graph)
    poses, peers_poses, times = _headings(graph, peer)
    figures |= told | times
    if truth_m is not None:
        errors = [
            trajectory_error_m(found[:, :2], truth_m)
            for found in (graph.poses, positions_m, poses, peers_poses)
        ]
        names = ("ate_uncorrected_m", "ate_positions_m", "ate_m", "ate_gtsam_m")
        figures |= dict(zip(names, errors, strict=True)) | {"ate_vs_gtsam": errors[2] / errors[3]}
    return figures | _incremental(graph, cost(poses, graph.constraints))


def _positions(graph: PoseGraph) -> tuple[Floats, dict[str, float]]:
    took_s, found = _timed(lambda: close_loops(graph))
    constraints = graph.constraints
    known = displacements(graph.poses, constraints)
    least = position_cost(best_positions(graph), constraints, known)
    ratio = position_cost(found.positions_m, constraints, known) / least
    return found.positions_m, {
        "positions_cost_ratio": ratio,
        "positions_replays": float(found.replays),
        "positions_ms": took_s * 1e3,
    }


def _headings(graph: PoseGraph, peer: Gtsam) -> tuple[Floats, Floats, dict[str, float]]:
    """Both from the same poses, each once to warm up, then in turn; each one's median time."""
    by_qr = peer.gives_up()
    poses = optimize(graph)
    peers_poses = peer.poses(peer.solve())
    rounds = [
        (_timed(lambda: optimize(graph))[0], _timed(peer.solve)[0])
        for _ in track(range(PAIRS), "correcting headings, and gtsam the same", transient=True)
    ]
    ours_s, peers_s = np.median(rounds, axis=0).tolist()
    ours, peers = (cost(found, graph.constraints) for found in (poses, peers_poses))
    told = {
        "heading_ms": ours_s * 1e3,
        "gtsam_ms": peers_s * 1e3,
        "gtsam_by_qr": float(by_qr),
        "time_vs_gtsam": ours_s / peers_s,
        "heading_cost": ours,
        "cost_vs_gtsam": ours / peers,
    }
    return poses, peers_poses, told


def _incremental(graph: PoseGraph, batch_cost: float) -> dict[str, float]:
    """Closures left out at random come one at a time; factoring anew, as between two closures, is
    timed apart.
    """
    count = min(NEW_CLOSURES, int(HELD_OUT_AT_MOST * len(graph.closures)))
    held_out = np.random.default_rng(SEED).permutation(len(graph.closures))[:count]
    rest = np.setdiff1d(np.arange(len(graph.closures)), held_out)
    solved = IncrementalSolver(PoseGraph(graph.poses, graph.steps, graph.closures.select(rest)))
    took_s = []
    settling_s = []
    for number, index in enumerate(
        track(held_out.tolist(), "closing one more loop", transient=True), 1
    ):
        closure = graph.closures.select(np.array([index]))
        took_s.append(_timed(partial(solved.add, closure))[0])
        if number % SETTLE_EVERY == 0:
            settling_s.append(_timed(solved.relinearize)[0])
    if not took_s:
        return {}
    return {
        "incremental_ms_p50": float(np.percentile(took_s, 50)) * 1e3,
        "incremental_ms_p99": float(np.percentile(took_s, 99)) * 1e3,
        "incremental_ms_max": max(took_s) * 1e3,
        "incremental_cost_ratio": cost(solved.graph.poses, solved.graph.constraints) / batch_cost,
        "incremental_closures": float(count),
        "settle_ms_p50": float(np.median(settling_s)) * 1e3 if settling_s else 0.0,
    }


def _timed(what: Callable[[], T]) -> tuple[float, T]:
    begun = time.perf_counter()
    result = what()
    return time.perf_counter() - begun, result
