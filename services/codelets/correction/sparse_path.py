"""The sparse-path codelet: places of the path where older ones stood already are joined into those
(beyond the paper).

The path and its closures, and with them the cost of a correction, then grow with the town, not with
driving time. The first pass of each place stays as it is.
"""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import DropNode, Operation, Phase
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    RECOLLECTION_ID,
    LinkKind,
    LoopClosure,
    Observations,
    PathSegment,
)
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.correction.joining import Joining, joining, joins, left, visited
from cogmap.services.codelets.correction.reattribution import closures_left, observations_left
from cogmap.services.codelets.mapping.path import JOINED, STAMP, with_rows
from cogmap.services.codelets.mapping.views import views_of


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task about the oldest segment of the path that is not sparse yet, once it is so
    old that no mistaken correction of it is undone any more; none while the path is to be moved.
    """
    if CORRECTION_ID in graph.nodes or RECOLLECTION_ID in graph.nodes:
        return []

    since_s = context.stamp_ns * 1e-9 - config.sparse_after_s
    for segment in graph.path[:-1]:
        if not segment.is_sparse:
            is_old = segment.rows.numpy()[-1, STAMP] <= since_s
            return [context.task(CODELET.name, about=[segment.id])] if is_old else []

    return []


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Join places of the segment into older ones, with all that refers to them."""
    path = graph.path
    names = [segment.id for segment in path]
    if not task.about or task.about[0] not in names[:-1]:
        raise MessageError(f"task {task.task_id} is about no segment before the path's last")

    number = names.index(task.about[0])
    known = path[:number]
    segment = path[number]
    joined = joining(rows_of(known), segment.rows.numpy(), config)

    lengths = [len(each.rows.numpy()) for each in known]
    numbers = np.repeat(np.array([each.number for each in known], np.int64), lengths)
    operations = _path_left(path, number, joined, config)
    operations += observations_left(graph, segment.id, joined, numbers)

    closures = list(graph.of_kind(LoopClosure))
    if closures:
        first = len(joined.known)
        ends = views_of(closures, rows_of(path))
        counted = ends._replace(i=ends.i - first, j=ends.j - first)
        operations += closures_left(closures, counted, joined)
    return Answer(operations)


CODELET = Codelet(
    name="sparse_path",
    phase=Phase.CORRECTION,
    due=due,
    run=run,
    reads=frozenset({PathSegment, Observations, LoopClosure, LinkKind.ALONG}),
    writes=frozenset({PathSegment, Observations, LoopClosure, LinkKind.ALONG, LinkKind.OBSERVES}),
    config=Config,
    section=SECTION,
)


def _path_left(
    path: list[PathSegment], number: int, joined: Joining, config: Config
) -> list[Operation]:
    """Return the segments of `path` that change if places of the segment `number` are joined into
    places of the segments before it.
    """
    before = path[:number]
    rows, count_after = left(joined)
    led = joins(joined.preceded(rows_of(before)[-1:]), config)

    # Each known place has the time when the agent was there last.
    times = visited(joined)
    after = []
    start = 0
    for segment in before:
        end = start + len(segment.rows.numpy())
        after.append(with_rows(segment, times[start:end]))
        start = end

    if len(rows):
        kept = msgspec.structs.replace(path[number], rows=Matrix.of(rows), is_sparse=True)
        after.append(_with_joins(kept, led))
    else:
        after[-1] = _with_joins(after[-1], led)

    if count_after:
        following = path[number + 1].rows.numpy().copy()
        following[0, JOINED] += count_after
        after.append(with_rows(path[number + 1], following))

    operations: list[Operation] = [segment for segment in after if segment not in path]
    if not len(rows):
        operations.append(DropNode(id=path[number].id))
    return operations


def _with_joins(segment: PathSegment, rows: Floats) -> PathSegment:
    """Add (m, 7) joins to the segment."""
    if not len(rows):
        return segment
    if segment.joins is not None:
        rows = np.vstack([segment.joins.numpy(), rows])
    return msgspec.structs.replace(segment, joins=Matrix.of(rows))
