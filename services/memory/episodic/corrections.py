"""Corrections of the map, with which the places of episodes move as all else does. Pure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import move_with
from cogmap.graph.graph import Graph
from cogmap.schemas.graph import DropNode, Operation
from cogmap.schemas.nodes import CORRECTION_ID, Correction, CorrectionColumn, PathSegment

OLD = slice(CorrectionColumn.OLD_X_M, CorrectionColumn.OLD_HEADING_RAD + 1)
NEW = slice(CorrectionColumn.NEW_X_M, CorrectionColumn.NEW_HEADING_RAD + 1)

Position = tuple[float, float]


class Corrections:
    """The correction that waits to be applied, and those that were since the last `take`."""

    def __init__(self) -> None:
        self._waiting: Correction | None = None
        self._applied: list[Floats] = []

    def note(self, operations: Sequence[Operation]) -> None:
        """Note a correction, and that it is applied: then the path moves as it is dropped."""
        for operation in operations:
            if isinstance(operation, Correction):
                self._waiting = operation

        is_dropped = any(
            isinstance(each, DropNode) and each.id == CORRECTION_ID for each in operations
        )
        has_moved = any(isinstance(each, PathSegment) for each in operations)
        if is_dropped and has_moved and self._waiting is not None:
            self._applied.append(np.asarray(self._waiting.rows.numpy(), np.float64))
        if is_dropped:
            self._waiting = None

    def note_all(self, graph: Graph) -> None:
        """Note the correction that waits in a graph that was loaded as a whole."""
        self._waiting = graph.get(Correction, CORRECTION_ID)

    def take(self) -> list[Floats]:
        """Take the rows of the corrections that were applied, (n, 7) each, the first one first."""
        applied = self._applied
        self._applied = []
        return applied


class Shift:
    """A correction of the map, of (n, 7) rows: each place moves with the place of the path that was
    nearest to it.
    """

    def __init__(self, rows: Floats) -> None:
        self._old = rows[:, OLD]
        self._new = rows[:, NEW]
        self._nearest = cKDTree(self._old[:, :2])

    def __call__(self, places_m: list[Position]) -> list[Position]:
        """Return where places are after the correction."""
        at_m = np.array(places_m)
        _, nearest = self._nearest.query(at_m)
        moved_m = move_with(at_m, self._old[nearest], self._new[nearest])
        return [(x_m, y_m) for x_m, y_m in moved_m.tolist()]
