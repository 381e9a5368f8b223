"""The path of the agent, what was observed along it, and what corrects it."""

from __future__ import annotations

from cogmap.schemas.array import Matrix
from cogmap.schemas.base import Count, Finite, Metres, Name
from cogmap.schemas.nodes.base import GraphNode, Spread, Stamp
from cogmap.schemas.nodes.columns import (
    CorrectionColumn,
    JoinColumn,
    ObservationColumn,
    PathColumn,
    RangeColumn,
    check_matrix,
)


class PathSegment(GraphNode, kw_only=True, frozen=True, tag="path_segment"):
    """Places of the agent's path in a row, `rows`: float64 (n, 11), see PathColumn.

    Segments are numbered from 0; one whose places were all joined into older ones is no more. Once
    it `is_sparse`, no more of its places are joined. `joins`: float64 (m, 7), see JoinColumn, are
    the steps between its places and those that others were joined into.
    """

    number: Count
    rows: Matrix
    is_sparse: bool = False
    joins: Matrix | None = None

    def __post_init__(self) -> None:
        check_matrix(self.id, self.rows, "<f8", (len(PathColumn),))
        if self.joins is not None:
            check_matrix(self.id, self.joins, "<f8", (len(JoinColumn),))


class Observations(GraphNode, kw_only=True, frozen=True, tag="observations"):
    """Observations of one landmark from places of path segment `number`.

    `rows`: float64 (n, 7), see ObservationColumn. `ranges`: float64 (m, 5), see RangeColumn, are
    those by range alone.
    """

    number: Count
    landmark: Name
    rows: Matrix
    ranges: Matrix | None = None

    def __post_init__(self) -> None:
        least = 1 if self.ranges is None else 0
        check_matrix(self.id, self.rows, "<f8", (len(ObservationColumn),), least)
        if self.ranges is not None:
            check_matrix(self.id, self.ranges, "<f8", (len(RangeColumn),))


class LoopClosure(GraphNode, kw_only=True, frozen=True, tag="loop_closure"):
    """A view that may close a loop (paper §5.6).

    What stands `ahead_m` and `left_m` of where the agent was at `from_ns` was seen at `range_m` and
    `bearing_rad` at `to_ns`, within `sd_m`. `cue` is the landmark, or the place; of a place the
    heading is known within `sd_rad`, which is 0 for a landmark. `before_ns` is when the landmark
    was last seen on the pass before, and `view` how many closures it has given on this pass. By
    `range_alone` no single view closes a loop: all ranges to the landmark together do.
    `consistent` and `accepted` are None until map correction has judged it.
    """

    from_ns: Stamp
    to_ns: Stamp
    cue: Name
    ahead_m: Finite
    left_m: Finite
    range_m: Metres
    bearing_rad: Finite
    sd_m: Spread
    sd_rad: Spread
    before_ns: Stamp = 0
    view: Count = 0
    range_alone: bool = False
    consistent: bool | None = None
    accepted: bool | None = None


class Correction(GraphNode, kw_only=True, frozen=True, tag="correction"):
    """A correction of the path that waits to be applied, `rows`: float64 (n, 7), see
    CorrectionColumn.
    """

    rows: Matrix

    def __post_init__(self) -> None:
        check_matrix(self.id, self.rows, "<f8", (len(CorrectionColumn),))
