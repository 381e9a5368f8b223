"""The path of the agent in the graph, as rows."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.schemas.nodes import PathColumn, PathSegment


def rows_of(path: Iterable[PathSegment]) -> Floats:
    """Return the rows, (n, len(PathColumn)), of path segments, the oldest first."""
    ordered = sorted(path, key=lambda segment: segment.number)

    rows = [np.zeros((0, len(PathColumn)))]
    for segment in ordered:
        rows.append(segment.rows.numpy())
    return np.vstack(rows)
