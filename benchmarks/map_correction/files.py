"""Pose graphs and true paths in files of a user's own."""

from __future__ import annotations

from pathlib import Path

from cogmap.data import pose_graph
from cogmap.data.pose_graph import read_true_positions
from cogmap.errors import UsageError
from cogmap.estimation.pose_graph import Constraints, PoseGraph
from cogmap.geometry.arrays import Floats


def read_graph(path: Path) -> PoseGraph:
    """Read the pose graph in a file. Raises UsageError if it cannot be read."""
    file = pose_graph.read(path)
    constraints = Constraints(file.i, file.j, file.measurement, file.information)
    return PoseGraph.of(file.poses, constraints)


def read_truth(path: Path | None, graph_path: Path, count: int) -> Floats | None:
    """Read the `count` true positions (n, 2) of a graph's poses, if a file of them is given."""
    if path is None:
        return None

    truth_m = read_true_positions(path)
    if len(truth_m) != count:
        raise UsageError(f"{path} has {len(truth_m)} poses, {graph_path} has {count}")

    return truth_m
