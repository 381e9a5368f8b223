"""Pose graphs in the plane as g2o writes them."""

from __future__ import annotations

from pathlib import Path

from cogmap.data.pose_graph import EDGE, POSE, PoseGraphFile, read_graph

KINDS = {"VERTEX_SE2": POSE, "EDGE_SE2": EDGE}
ORDER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def read_g2o(path: Path) -> PoseGraphFile:
    """The graph of a `.g2o` file. Raises UsageError naming file and line."""
    return read_graph(path, KINDS, ORDER)
