"""The path that the agent took, as nodes of the graph: what map correction corrects (paper §5.6).

The pose believed at each place is the agent's own, which landmarks and corrections change. The
steps between the poses by path integration alone are what self-motion measured, and nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.estimation.pose_graph import Constraints, diagonal_information
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import mean_pose, relative
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Link, Operation, Phase
from cogmap.schemas.nodes import (
    SELF_ID,
    JoinColumn,
    LinkKind,
    Object,
    Observations,
    PathColumn,
    PathSegment,
    Self,
    object_id,
    observations_id,
    segment_id,
)
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.mapping.observations import Viewpoint, extended, is_observed_from
from cogmap.services.codelets.nodes import nodes_of

ROWS = 64
COLUMNS = len(PathColumn)
STAMP = PathColumn.STAMP_S
LAST = PathColumn.LAST_S
JOINED = PathColumn.JOINED
POSE = slice(PathColumn.X_M, PathColumn.HEADING_RAD + 1)
ODOMETRY = slice(PathColumn.ODOMETRY_X_M, PathColumn.ODOMETRY_HEADING_RAD + 1)
JOIN_STEP = slice(JoinColumn.X_M, JoinColumn.HEADING_RAD + 1)
VARIANCES = slice(PathColumn.VARIANCE_M2, PathColumn.VARIANCE_RAD2 + 1)


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task where the path grows, or a landmark is in view that was not observed from the path's
    last place.
    """
    percepts = context.percepts.objects
    last = graph.last_segment
    if last is not None and not path_grows(graph, config):
        percepts = _not_observed(percepts, last, graph)
        if not percepts:
            return []

    return [context.task(CODELET.name, about=[SELF_ID], percepts=percepts)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Add the place where the agent is now to the path's last segment, and what landmarks are
    observed from there.

    Where the agent has hardly moved from the last place, they are observed from that.
    """
    agent = graph.agent
    if agent is None:
        raise MessageError(f"task {task.task_id}: the graph has no self node")

    number, rows = _last_rows(graph)
    operations: list[Operation] = []
    if _is_apart(rows, agent, config.path_spacing_m) or _is_lost_since(rows, agent):
        row = _row(task.stamp_ns, agent)
        number, rows = _appended(number, rows, row)
        operations += segments(rows, number)

    viewpoint = _viewpoint(agent, number, rows[-1])
    for percept in task.percepts:
        operations += _observe(percept, viewpoint, graph)

    return Answer(operations)


CODELET = Codelet(
    name="path",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self, PathSegment, Observations}),
    writes=frozenset({PathSegment, Observations, LinkKind.OBSERVES, LinkKind.ALONG}),
    config=Config,
    section=SECTION,
)


def path_grows(graph: Graph, config: Config) -> bool:
    """Whether the agent has gone `path_spacing_m` from the path's last place, or has got lost
    there, or there is no path.

    That is by path integration alone: the pose believed may jump, or hardly move while the agent is
    lost.
    """
    agent = graph.agent
    last = graph.last_segment
    if agent is None or last is None:
        return True

    rows = last.rows.numpy()
    if _is_lost_since(rows, agent):
        return True
    return _is_apart(rows, agent, config.path_spacing_m)


def with_rows(segment: PathSegment, rows: Floats) -> PathSegment:
    """A path segment with other (n, COLUMNS) rows."""
    return msgspec.structs.replace(segment, rows=Matrix.of(rows))


def segments(rows: Floats, first: int = 0) -> list[PathSegment]:
    """The path segments of (n, COLUMNS) `rows`, numbered from `first`."""
    parts = []
    for start in range(0, len(rows), ROWS):
        number = first + start // ROWS
        part = PathSegment(
            id=segment_id(number),
            base_level=1.0,
            number=number,
            rows=Matrix.of(rows[start : start + ROWS]),
        )
        parts.append(part)

    return parts


def steps_of(rows: Floats, config: Config) -> Constraints:
    """The steps of path integration from each row to the next, as certain as self-motion states, or
    less, by the distance.
    """
    places = np.arange(max(0, len(rows) - 1))
    odometry = rows[:, ODOMETRY]
    steps = relative(odometry[:-1], odometry[1:])

    variances = rows[:, VARIANCES]
    stated = np.diff(variances, axis=0)
    joined_m = rows[1:, JOINED] * config.path_spacing_m
    return Constraints(
        i=places,
        j=places + 1,
        measurement=steps,
        information=_step_information(steps, stated, joined_m, config),
    )


def joins_of(path: Iterable[PathSegment], stamps_s: Floats) -> Constraints:
    """The joins of path segments, between the places of the whole path, at `stamps_s` (n,)."""
    rows = [np.zeros((0, len(JoinColumn)))]
    for segment in path:
        if segment.joins is not None:
            rows.append(segment.joins.numpy())

    joins = np.vstack(rows)
    return Constraints(
        i=stamps_s.searchsorted(joins[:, JoinColumn.FROM_S]),
        j=stamps_s.searchsorted(joins[:, JoinColumn.TO_S]),
        measurement=joins[:, JOIN_STEP],
        information=diagonal_information(
            position=1 / joins[:, JoinColumn.VARIANCE_M2],
            heading=1 / joins[:, JoinColumn.VARIANCE_RAD2],
        ),
    )


def _step_information(steps: Floats, stated: Floats, joined_m: Floats, config: Config) -> Floats:
    """(m, 3, 3): the information of (m, 3) steps, by the variances that are `stated` of position
    and heading, (m, 2), or the least ones.

    Where a step led over `joined_m` (m,) of places that were joined into others, its turns on the
    way there move its end.
    """
    stated_m2, stated_rad2 = stated.T
    least_m2, least_rad2 = _least_variances(steps, joined_m, config)

    variance_rad2 = np.maximum(least_rad2, stated_rad2)
    by_turns_m2 = variance_rad2 * joined_m**2 / 3
    variance_m2 = np.maximum(least_m2, stated_m2) + by_turns_m2
    return diagonal_information(
        position=1 / variance_m2,
        heading=1 / variance_rad2,
    )


def _least_variances(steps: Floats, joined_m: Floats, config: Config) -> tuple[Floats, Floats]:
    """(m,) each: the least variance of (m, 3) steps, of the position and of the heading."""
    moved_m = np.hypot(steps[:, 0], steps[:, 1])
    length_m = moved_m.clip(config.path_spacing_m / 2) + joined_m
    turned_rad = np.abs(steps[:, 2])

    variance_m2 = config.path_variance_per_m * length_m
    by_length_rad2 = config.heading_variance_per_m * length_m
    by_turn_rad2 = config.heading_variance_per_rad * turned_rad
    return variance_m2, by_length_rad2 + by_turn_rad2


def _last_rows(graph: Graph) -> tuple[int, Floats]:
    """The number and the rows of the path's last segment; 0 and none before the path begins."""
    last = graph.last_segment
    if last is None:
        return 0, np.zeros((0, COLUMNS))

    return last.number, last.rows.numpy()


def _appended(number: int, rows: Floats, row: Floats) -> tuple[int, Floats]:
    """The last segment, `number` with `rows`, after one more row: the next where it was full."""
    if len(rows) >= ROWS:
        return number + 1, row

    return number, np.vstack([rows, row])


def _viewpoint(agent: Self, number: int, row: Floats) -> Viewpoint:
    """Where the agent is, from the place `row` of path segment `number`."""
    step = relative(row[ODOMETRY], agent.odometry.pose())
    return Viewpoint(
        number=number,
        stamp_s=float(row[STAMP]),
        step=step,
        range_gain=agent.range_gain,
    )


def _row(stamp_ns: int, agent: Self) -> Floats:
    """(1, COLUMNS): the place where the agent is, as a row of the path."""
    stamp_s = stamp_ns * 1e-9
    pose = mean_pose(agent.samples.numpy())
    odometry = agent.odometry.pose()
    variances = agent.odometry.variances()

    row = np.concatenate([[stamp_s], pose, odometry, variances, [stamp_s, 0.0]])
    return row[None]


def _is_apart(rows: Floats, agent: Self, spacing_m: float) -> bool:
    """Whether path integration leads `spacing_m` or more from the last row, or there is none."""
    if not len(rows):
        return True

    before = rows[-1, ODOMETRY]
    moved_m = agent.odometry.pose()[:2] - before[:2]
    distance_m = np.hypot(*moved_m)
    return bool(distance_m >= spacing_m)


def _is_lost_since(rows: Floats, agent: Self) -> bool:
    """Whether the agent has got lost since the last row: what it sees now, it may see from
    elsewhere.
    """
    if not agent.misfits.is_lost:
        return False

    last_s = float(rows[-1, STAMP])
    last_fit_s = agent.misfits.last_fit_ns * 1e-9
    return last_s <= last_fit_s


def _observations(graph: Graph, number: int, label: str) -> Observations | None:
    name = observations_id(number, label)
    return graph.get(Observations, name)


def _not_observed(percepts: list[Percept], last: PathSegment, graph: Graph) -> list[Percept]:
    """The percepts of landmarks that were not observed from the last place of the path."""
    rows = last.rows.numpy()
    last_s = float(rows[-1, STAMP])

    new = []
    for percept in percepts:
        observations = _observations(graph, last.number, percept.label)
        if not is_observed_from(observations, last_s):
            new.append(percept)
    return new


def _observe(percept: Percept, viewpoint: Viewpoint, graph: Graph) -> list[Operation]:
    """The observations of a landmark with one more, where range and bearing are known."""
    before = _observations(graph, viewpoint.number, percept.label)
    if not (percept.has_range and percept.has_bearing):
        return []
    if is_observed_from(before, viewpoint.stamp_s):
        return []

    after = extended(before, viewpoint, percept)
    if before is not None:
        return [after]

    return [after, *links_of(after)]


def links_of(observations: Observations) -> list[Link]:
    """The links from new observations to the landmark and to the path segment."""
    landmark = object_id(observations.landmark)
    segment = segment_id(observations.number)

    return [
        Link(source=observations.id, target=landmark, kind=LinkKind.OBSERVES),
        Link(source=observations.id, target=segment, kind=LinkKind.ALONG),
    ]


def objects_along(graph: Graph, segment: PathSegment) -> list[tuple[Observations, Object]]:
    """The observations along a path segment, by landmark, of objects that the map has."""
    names = sorted(graph.links.sources(segment.id, LinkKind.ALONG))

    found = []
    for observations in nodes_of(graph, Observations, names):
        landmark = graph.get(Object, object_id(observations.landmark))
        if landmark is not None:
            found.append((observations, landmark))

    return found
