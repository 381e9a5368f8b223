"""The columns of place nodes, and of the matrices that nodes keep."""

from __future__ import annotations

import enum

from cogmap.schemas.array import Matrix

POSE_COLUMNS = 3
MAX_ROWS = 100_000
TILE_SIDE = 32
TILE_CELLS = TILE_SIDE**2


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

    `LAST_S` is when the agent was there last, and `JOINED` how many places between this one and the
    one before were joined into older ones.
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
    LAST_S = 9
    JOINED = 10


class JoinColumn(enum.IntEnum):
    """Columns of the joins of a path segment: the times of the two places, the pose of the second
    in the frame of the first, and its variances, by either axis and of the heading.
    """

    FROM_S = 0
    TO_S = 1
    X_M = 2
    Y_M = 3
    HEADING_RAD = 4
    VARIANCE_M2 = 5
    VARIANCE_RAD2 = 6


class ObservationColumn(enum.IntEnum):
    """Columns of observations of a landmark from places of the path.

    Where it stood as seen from the place, forwards and left; the standard deviations along and
    across the line of sight, and that line's direction; 1 if it was seen whole, 0 if something
    nearer or the view's border hid a part of it.
    """

    STAMP_S = 0
    FORWARDS_M = 1
    LEFT_M = 2
    ALONG_SD_M = 3
    ACROSS_SD_M = 4
    DIRECTION_RAD = 5
    WHOLE = 6


class RangeColumn(enum.IntEnum):
    """Columns of observations of a landmark by its range alone from places of the path.

    Where the agent stood then as seen from the place, forwards and left; the range and its standard
    deviation.
    """

    STAMP_S = 0
    FORWARDS_M = 1
    LEFT_M = 2
    RANGE_M = 3
    RANGE_SD_M = 4


class CorrectionColumn(enum.IntEnum):
    """Columns of a correction: when, and the pose of the path before and after."""

    STAMP_S = 0
    OLD_X_M = 1
    OLD_Y_M = 2
    OLD_HEADING_RAD = 3
    NEW_X_M = 4
    NEW_Y_M = 5
    NEW_HEADING_RAD = 6


class RecalledColumn(enum.IntEnum):
    """Columns of the objects of a map in long-term memory: where each stood, how surely, its size,
    and the number of views that agreed with that.
    """

    X_M = 0
    Y_M = 1
    X_SD_M = 2
    Y_SD_M = 3
    WIDTH_M = 4
    HEIGHT_M = 5
    SIGHTINGS = 6


class RouteColumn(enum.IntEnum):
    """Columns of a route: positions on its map, from the agent to the goal."""

    X_M = 0
    Y_M = 1


def check_matrix(
    node: str, matrix: Matrix, dtype: str, columns: tuple[int, ...], least: int = 1
) -> None:
    """Raise ValueError if a matrix is of another dtype or width, or has fewer rows than `least`, or
    too many.
    """
    rows, width = matrix.shape
    if matrix.dtype != dtype or width not in columns:
        wanted = " or ".join(map(str, columns))
        raise ValueError(f"{node}: {matrix.dtype} of {width} columns, not {dtype} of {wanted}")

    if not least <= rows <= MAX_ROWS:
        raise ValueError(f"{node}: {rows} rows, not {least} to {MAX_ROWS}")
