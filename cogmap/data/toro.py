"""Pose graphs in the plane as TORO writes them: its information matrices come in another order than
g2o's.
"""

from __future__ import annotations

from pathlib import Path

from cogmap.data.pose_graph import EDGE, POSE, PoseGraphFile, read_graph

KINDS = {"VERTEX2": POSE, "EDGE2": EDGE, "VERTEX": POSE, "EDGE": EDGE}
ORDER = ((0, 0), (0, 1), (1, 1), (2, 2), (0, 2), (1, 2))


def read_toro(path: Path) -> PoseGraphFile:
    """The graph of a `.graph` file. Raises UsageError naming file and line."""
    return read_graph(path, KINDS, ORDER)
