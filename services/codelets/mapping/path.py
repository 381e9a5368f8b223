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
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.mapping.observations import Viewpoint, extended, is_observed_from
from cogmap.services.codelets.nodes import nodes_of

# Places in a segment. It is written anew with each of them, so it is kept to 6 KB.
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
    """Return one task if the path grows, or a landmark is in view that was not observed from the
    path's last place.
    """
    percepts = context.percepts.objects
    last = graph.last_segment
    if last is not None and not path_grows(graph, config):
        last_s = float(last.rows.numpy()[-1, STAMP])
        percepts = [
            percept
            for percept in percepts
            if not is_observed_from(_observations(graph, last.number, percept.label), last_s)
        ]
        if not percepts:
            return []

    return [context.task(CODELET.name, about=[SELF_ID], percepts=percepts)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Add the place where the agent is now to the path's last segment, and what landmarks are
    observed from there.

    If the agent has hardly moved from the last place, they are observed from that.
    """
    agent = graph.agent
    if agent is None:
        raise MessageError(f"task {task.task_id}: the graph has no self node")

    last = graph.last_segment
    number = 0 if last is None else last.number
    rows = np.zeros((0, COLUMNS)) if last is None else last.rows.numpy()
    operations: list[Operation] = []
    if _is_apart(rows, agent, config.path_spacing_m) or _is_lost_since(rows, agent):
        stamp_s = task.stamp_ns * 1e-9
        pose = mean_pose(agent.samples.numpy())
        odometry = agent.odometry
        row = np.concatenate([[stamp_s], pose, odometry.pose(), odometry.variances(), [stamp_s, 0]])
        is_full = len(rows) >= ROWS
        number += is_full
        rows = row[None] if is_full else np.vstack([rows, row])
        operations += segments(rows, number)

    viewpoint = Viewpoint(
        number=number,
        stamp_s=float(rows[-1, STAMP]),
        step=relative(rows[-1, ODOMETRY], agent.odometry.pose()),
        range_gain=agent.range_gain,
    )
    for percept in task.percepts:
        if not percept.has_range:
            continue

        before = _observations(graph, number, percept.label)
        if not is_observed_from(before, viewpoint.stamp_s):
            after = extended(before, viewpoint, percept)
            operations.append(after)
            operations += links_of(after) if before is None else []

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
    """Return whether the agent has gone `path_spacing_m` from the path's last place, or has got
    lost there, or there is no path.

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
    """Replace the rows of a path segment by other (n, COLUMNS) rows."""
    return msgspec.structs.replace(segment, rows=Matrix.of(rows))


def segments(rows: Floats, first: int = 0) -> list[PathSegment]:
    """Divide (n, COLUMNS) `rows` into path segments, numbered from `first`."""
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
    """Return the steps of path integration from each row to the next, as certain as self-motion
    states, but no more certain than their length and turn allow.
    """
    places = np.arange(max(0, len(rows) - 1))
    odometry = rows[:, ODOMETRY]
    steps = relative(odometry[:-1], odometry[1:])

    turned_rad = np.abs(steps[:, 2])
    joined_m = rows[1:, JOINED] * config.path_spacing_m
    length_m = np.hypot(steps[:, 0], steps[:, 1]).clip(config.path_spacing_m / 2) + joined_m
    least_m2 = config.path_variance_per_m * length_m
    least_rad2 = config.heading_variance_per_m * length_m
    least_rad2 += config.heading_variance_per_rad * turned_rad

    # A step that led over places which were joined into others ends where its turns on the way
    # there moved it.
    stated_m2, stated_rad2 = np.diff(rows[:, VARIANCES], axis=0).T
    variance_rad2 = np.maximum(least_rad2, stated_rad2)
    by_turns_m2 = variance_rad2 * joined_m**2 / 3
    variance_m2 = np.maximum(least_m2, stated_m2) + by_turns_m2
    return Constraints(
        i=places,
        j=places + 1,
        measurement=steps,
        information=diagonal_information(position=1 / variance_m2, heading=1 / variance_rad2),
    )


def joins_of(path: Iterable[PathSegment], stamps_s: Floats) -> Constraints:
    """Return path segments' joins, between the places of the whole path, at `stamps_s` (n,)."""
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


def _is_apart(rows: Floats, agent: Self, spacing_m: float) -> bool:
    """Return whether path integration leads `spacing_m` or more from the last row, or there is
    none.
    """
    if not len(rows):
        return True

    moved_m = agent.odometry.pose()[:2] - rows[-1, ODOMETRY][:2]
    return bool(np.hypot(*moved_m) >= spacing_m)


def _is_lost_since(rows: Floats, agent: Self) -> bool:
    """Return whether the agent has got lost since the last row: what it sees now, it may see from
    elsewhere.
    """
    if not agent.misfits.is_lost:
        return False

    return float(rows[-1, STAMP]) <= agent.misfits.last_fit_ns * 1e-9


def _observations(graph: Graph, number: int, label: str) -> Observations | None:
    name = observations_id(number, label)
    return graph.get(Observations, name)


def links_of(observations: Observations) -> list[Link]:
    """Return the links from new observations to the landmark and to the path segment."""
    landmark = object_id(observations.landmark)
    segment = segment_id(observations.number)

    return [
        Link(source=observations.id, target=landmark, kind=LinkKind.OBSERVES),
        Link(source=observations.id, target=segment, kind=LinkKind.ALONG),
    ]


def objects_along(graph: Graph, segment: PathSegment) -> list[tuple[Observations, Object]]:
    """Return a path segment's observations of objects on the map, with these, by landmark."""
    names = sorted(graph.links.sources(segment.id, LinkKind.ALONG))

    found = []
    for observations in nodes_of(graph, Observations, names):
        landmark = graph.get(Object, object_id(observations.landmark))
        if landmark is not None:
            found.append((observations, landmark))

    return found
