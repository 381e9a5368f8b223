"""The kinds of nodes, links and place columns: each is named here once, with its fields and rules.

A node of the graph is a struct of its kind, so that the decoder validates it. A kind that is not
known here travels as the generic `Node`: a codelet of somebody else's package needs no change of
this table. Positions are in metres in the frame of the map that the node is on, x east, y north.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Annotated

import msgspec
import numpy as np
import numpy.typing as npt

from schemas.array import Matrix
from schemas.base import Count, Finite, Name, Part, Scalar, Unit

ROOT_MAP = "map:0"
SELF_ID = "self"
CORRECTION_ID = "correction"
NEVER_NS = -1

Metres = Annotated[float, msgspec.Meta(ge=0, le=1e6)]
Positive = Annotated[float, msgspec.Meta(gt=0, le=1e9)]
Spread = Annotated[float, msgspec.Meta(ge=0, le=1e9)]
Stamp = Annotated[int, msgspec.Meta(ge=NEVER_NS, le=2**62)]


class LinkKind(enum.StrEnum):
    """The kinds of links that the architecture itself uses; a codelet may use others.

    AT: from the self or an object to the place node nearest to it. INSTANCE: from a percept to the
    object that it is a sighting of. OBSERVES and ALONG: from observations to the object observed,
    and to the path segment that they were made along. NEXT: between neighbouring place nodes; these
    are kept in the tiles' columns.
    """

    AT = "at"
    INSTANCE = "instance"
    OBSERVES = "observes"
    ALONG = "along"
    NEXT = "next"


EXCLUSIVE_LINKS = frozenset({LinkKind.AT, LinkKind.INSTANCE, LinkKind.OBSERVES, LinkKind.ALONG})
"""Kinds of which a node has one link: a new one replaces it."""


class PlaceColumn(enum.StrEnum):
    """The columns of place nodes, float32 each.

    A cell holds the links to four of its eight neighbours, the other four being the neighbours'
    own: their weight, from 0 (not traversable) to 1, and the evidence accumulated for it.
    """

    ACTIVATION = "activation"
    ROAD = "road"
    OBSTACLE = "obstacle"
    WEIGHT_E = "weight_e"
    WEIGHT_NE = "weight_ne"
    WEIGHT_N = "weight_n"
    WEIGHT_NW = "weight_nw"
    EVIDENCE_E = "evidence_e"
    EVIDENCE_NE = "evidence_ne"
    EVIDENCE_N = "evidence_n"
    EVIDENCE_NW = "evidence_nw"


class SelfColumn(enum.IntEnum):
    """Columns of the samples of the self: its pose and, optionally, the gains of its senses."""

    X_M = 0
    Y_M = 1
    HEADING_RAD = 2
    SPEED_GAIN = 3
    TURN_GAIN = 4
    DRIFT_RAD_PER_M = 5
    RANGE_GAIN = 6


class PathColumn(enum.IntEnum):
    """Columns of a path segment: when, the pose believed, the pose by path integration alone, and
    the variance of the latter since the start, of the distance and of the heading.
    """

    STAMP_S = 0
    X_M = 1
    Y_M = 2
    HEADING_RAD = 3
    ODOMETRY_X_M = 4
    ODOMETRY_Y_M = 5
    ODOMETRY_HEADING_RAD = 6
    VARIANCE_M2 = 7
    VARIANCE_RAD2 = 8


class ObservationColumn(enum.IntEnum):
    """Columns of observations of a landmark from places of the path.

    Where it stood as seen from the place, forwards and left; the standard deviations along and
    across the line of sight, and that line's direction.
    """

    STAMP_S = 0
    FORWARDS_M = 1
    LEFT_M = 2
    ALONG_SD_M = 3
    ACROSS_SD_M = 4
    DIRECTION_RAD = 5


class CorrectionColumn(enum.IntEnum):
    """Columns of a correction: when, and the pose of the path before and after."""

    STAMP_S = 0
    OLD_X_M = 1
    OLD_Y_M = 2
    OLD_HEADING_RAD = 3
    NEW_X_M = 4
    NEW_Y_M = 5
    NEW_HEADING_RAD = 6


POSE_COLUMNS = 3
MAX_SAMPLES = 100_000


class GraphNode(Part, kw_only=True, frozen=True):
    """What every node has. `activation` and `base_level` are as of cognitive cycle `cycle`; their
    values now follow from the graph's decay.
    """

    id: Name
    activation: Unit = 0.0
    base_level: Unit = 0.0
    cycle: Count = 0


class Node(GraphNode, kw_only=True, frozen=True, tag="node"):
    """A node of a kind that is not in this table."""

    kind: Name
    attributes: dict[str, Scalar] = {}
    samples: Matrix | None = None


class Self(GraphNode, kw_only=True, frozen=True, tag="self"):
    """The agent: samples of its pose (paper §5.4), and what localization keeps between cycles.

    `samples`: float64 (n, 3) or (n, 7), see SelfColumn. The pose is their mean. `kept_share` is the
    share of the samples that rejection kept. `misfit_count` is the number of views in a row in
    which nothing fitted, `first_misfit` the landmark that did not fit first, and `is_lost` whether
    another did not fit since. `stationary_since_ns` is NEVER_NS while the agent moves.
    """

    map: Name = ROOT_MAP
    stamp_ns: Stamp = NEVER_NS
    x_m: Finite = 0.0
    y_m: Finite = 0.0
    heading_rad: Finite = 0.0
    x_sd_m: Spread = 0.0
    y_sd_m: Spread = 0.0
    heading_sd_rad: Spread = 0.0
    kept_share: Unit = 1.0
    misfit_count: Count = 0
    first_misfit: str = ""
    is_lost: bool = False
    last_misfit_ns: Stamp = 0
    last_fit_ns: Stamp = 0
    stationary_since_ns: Stamp = NEVER_NS
    speed_gain: Finite = 0.0
    turn_gain: Finite = 0.0
    range_gain: Finite = 0.0
    odometry_x_m: Finite = 0.0
    odometry_y_m: Finite = 0.0
    odometry_heading_rad: Finite = 0.0
    odometry_variance_m2: Spread = 0.0
    odometry_variance_rad2: Spread = 0.0
    samples: Matrix

    def __post_init__(self) -> None:
        _check_matrix(self.id, self.samples, "<f8", (POSE_COLUMNS, len(SelfColumn)))


class Percept(GraphNode, kw_only=True, frozen=True, tag="percept"):
    """A PAM node over threshold: an object recognised in the view of this cycle."""

    label: Name
    bearing_rad: Finite
    range_m: Positive


class Object(GraphNode, kw_only=True, frozen=True, tag="object"):
    """An object of the cognitive map, with samples of its position (paper §5.2).

    `offsets_m`: float16 (n, 2), the samples relative to their mean (`x_m`, `y_m`), which keeps them
    to a thousandth of their spread. `sightings` is the number of views that agree with the
    position, `misses` that of views in a row that do not. One that is `surveyed` was given, and
    stays where it is. `last_seen_ns` and `created_ns` are times of views.
    """

    label: Name
    map: Name = ROOT_MAP
    x_m: Finite
    y_m: Finite
    x_sd_m: Spread = 0.0
    y_sd_m: Spread = 0.0
    width_m: Metres = 0.0
    height_m: Metres = 0.0
    sightings: Count = 0
    misses: Count = 0
    last_seen_ns: Stamp = NEVER_NS
    created_ns: Stamp = 0
    surveyed: bool = False
    salience: Annotated[float, msgspec.Meta(ge=-1, le=1)] = 0.0
    offsets_m: Matrix | None = None

    def __post_init__(self) -> None:
        if self.offsets_m is not None:
            _check_matrix(self.id, self.offsets_m, "<f2", (2,))

    def positions_m(self) -> npt.NDArray[np.float64]:
        """(n, 2) samples of its position; one, the mean, where it has none."""
        mean = np.array([[self.x_m, self.y_m]])
        if self.offsets_m is None:
            return mean

        return mean + self.offsets_m.numpy()


class PathSegment(GraphNode, kw_only=True, frozen=True, tag="path_segment"):
    """Places of the agent's path in a row, `rows`: float64 (n, 9), see PathColumn.

    Segments are numbered from 0.
    """

    number: Count
    rows: Matrix

    def __post_init__(self) -> None:
        _check_matrix(self.id, self.rows, "<f8", (len(PathColumn),))


class Observations(GraphNode, kw_only=True, frozen=True, tag="observations"):
    """Observations of one landmark from places of path segment `number`.

    `rows`: float64 (n, 6), see ObservationColumn.
    """

    number: Count
    landmark: Name
    rows: Matrix

    def __post_init__(self) -> None:
        _check_matrix(self.id, self.rows, "<f8", (len(ObservationColumn),))


class LoopClosure(GraphNode, kw_only=True, frozen=True, tag="loop_closure"):
    """A view that may close a loop (paper §5.6).

    What stands `ahead_m` and `left_m` of where the agent was at `from_ns` was seen at `range_m` and
    `bearing_rad` at `to_ns`, within `sd_m`. `cue` is the landmark, or the place; of a place the
    heading is known within `sd_rad`, which is 0 for a landmark. `before_ns` is when the landmark
    was last seen on the pass before, and `view` how many closures it has given on this pass.
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
    consistent: bool | None = None
    accepted: bool | None = None


class Correction(GraphNode, kw_only=True, frozen=True, tag="correction"):
    """A correction of the path that waits to be applied, `rows`: float64 (n, 7), see
    CorrectionColumn.
    """

    rows: Matrix

    def __post_init__(self) -> None:
        _check_matrix(self.id, self.rows, "<f8", (len(CorrectionColumn),))


class Map(GraphNode, kw_only=True, frozen=True, tag="map"):
    """A cognitive map: a grid of place nodes `cell_m` apart, in a frame of its own.

    The frame's origin and direction are in the frame of `parent`; the root map has none.
    """

    cell_m: Annotated[float, msgspec.Meta(gt=0, le=1e4)]
    parent: str = ""
    x_m: Finite = 0.0
    y_m: Finite = 0.0
    heading_rad: Finite = 0.0


AnyNode = (
    Node | Self | Percept | Object | PathSegment | Observations | LoopClosure | Correction | Map
)


@dataclass(frozen=True)
class KindRules:
    """What holds for all nodes of a kind.

    Nodes that are `persistent` do not decay. All nodes of an `indexed` kind are found without a
    search. What `moves_with_path` is moved when the map is corrected. `offered` kinds may be
    written by an offer, all others by codelets alone. What is not `droppable` is never forgotten.
    """

    persistent: bool = False
    indexed: bool = False
    moves_with_path: bool = False
    offered: bool = False
    droppable: bool = True


KINDS: dict[type[GraphNode], KindRules] = {
    Node: KindRules(offered=True),
    Self: KindRules(persistent=True, moves_with_path=True, droppable=False),
    Percept: KindRules(),
    Object: KindRules(indexed=True, moves_with_path=True, offered=True),
    PathSegment: KindRules(persistent=True, indexed=True, moves_with_path=True),
    Observations: KindRules(persistent=True, indexed=True),
    LoopClosure: KindRules(persistent=True, indexed=True),
    Correction: KindRules(persistent=True),
    Map: KindRules(persistent=True, indexed=True, offered=True, droppable=False),
}


def kind_of(node: GraphNode) -> str:
    """The name of a node's kind, as it travels."""
    if isinstance(node, Node):
        return node.kind

    return kind_name(type(node))


def kind_name(kind: type[GraphNode]) -> str:
    """The name of a kind, as it travels."""
    return str(kind.__struct_config__.tag)


def object_id(label: str) -> str:
    """The id of the object that perception calls `label`."""
    return f"object:{label}"


def percept_id(label: str) -> str:
    """The id of the percept of the object that perception calls `label`."""
    return f"percept:{label}"


def segment_id(number: int) -> str:
    """The id of a path segment."""
    return f"path:{number}"


def observations_id(number: int, label: str) -> str:
    """The id of the observations of landmark `label` along path segment `number`."""
    return f"observations:{number}:{label}"


def place_id(i: int, j: int, map_id: str = ROOT_MAP) -> str:
    """The id of the place node of grid cell (i, j)."""
    return f"place:{map_id}:{i}:{j}"


def place_cell(identifier: str) -> tuple[str, int, int] | None:
    """The map and the grid cell of a place node's id; None for any other node's."""
    if not identifier.startswith("place:"):
        return None

    try:
        map_id, i, j = identifier.removeprefix("place:").rsplit(":", 2)
        return map_id, int(i), int(j)
    except ValueError:
        return None


def nearest_place(x_m: float, y_m: float, cell_m: float, map_id: str = ROOT_MAP) -> str:
    """The id of the place node nearest to a position, in a grid of `cell_m`."""
    i = round(x_m / cell_m)
    j = round(y_m / cell_m)
    return place_id(i, j, map_id)


def _check_matrix(node: str, matrix: Matrix, dtype: str, columns: tuple[int, ...]) -> None:
    """Raise ValueError where a matrix is of another dtype or width, or has no rows or too many."""
    rows, width = matrix.shape
    if matrix.dtype != dtype or width not in columns:
        wanted = " or ".join(map(str, columns))
        raise ValueError(f"{node}: {matrix.dtype} of {width} columns, not {dtype} of {wanted}")

    if not 1 <= rows <= MAX_SAMPLES:
        raise ValueError(f"{node}: {rows} rows, not 1 to {MAX_SAMPLES}")
