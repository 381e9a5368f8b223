"""Pose graphs and true paths in files of a user's own."""

from __future__ import annotations

from pathlib import Path

from cogmap.data.g2o import read_g2o
from cogmap.data.pose_graph import PoseGraphFile, read_true_positions
from cogmap.data.toro import read_toro
from cogmap.errors import MessageError, UsageError
from cogmap.estimation.pose_graph import Constraints, PoseGraph
from cogmap.geometry.arrays import Floats

READERS = {".g2o": read_g2o, ".graph": read_toro, ".toro": read_toro}


def read_graph(path: Path) -> PoseGraph:
    """Read the pose graph in a file, whose suffix names its format.

    Raises UsageError if it cannot be read.
    """
    unpacked = path.with_suffix("") if path.suffix == ".xz" else path
    suffix = unpacked.suffix
    if suffix not in READERS:
        known = ", ".join(READERS)
        raise UsageError(f"{path} is none of {known}, or one of them packed as .xz")

    file: PoseGraphFile = READERS[suffix](path)
    constraints = Constraints(file.i, file.j, file.measurement, file.information)
    try:
        return PoseGraph.of(file.poses, constraints)
    except MessageError as error:
        raise UsageError(f"{path}: {error}") from None


def read_truth(path: Path | None, graph_path: Path, count: int) -> Floats | None:
    """Read the `count` true positions (n, 2) of a graph's poses, if a file of them is given."""
    if path is None:
        return None

    truth_m = read_true_positions(path)
    if len(truth_m) != count:
        raise UsageError(f"{path} has {len(truth_m)} poses, {graph_path} has {count}")

    return truth_m
