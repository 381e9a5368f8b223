"""The join-map codelet: a map recalled from long-term memory becomes one with the root map (beyond
the paper).

The agent began in a frame of its own. All that it has learned in this run is moved into the frame
of the recalled map, whose objects and place nodes are then known as if it had seen them today.
"""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.se2 import transform_from
from cogmap.graph.graph import Graph
from cogmap.graph.window import EVIDENCE_COLUMNS, WEIGHT_COLUMNS
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import DropNode, Operation, Phase
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    PLAN_ID,
    RECOLLECTION_ID,
    ROOT_MAP,
    TILE_SIDE,
    CorrectionColumn,
    Goal,
    GraphNode,
    LinkKind,
    Map,
    Object,
    Observations,
    PathSegment,
    Plan,
    Recollection,
    Self,
)
from cogmap.services.codelets.cells import written_cells
from cogmap.services.codelets.correction.apply_correction import moved
from cogmap.services.codelets.correction.place_columns import MOVED_COLUMNS
from cogmap.services.codelets.correction.recalled_objects import recalled_objects
from cogmap.services.codelets.correction.recalled_sub_maps import recalled_sub_maps
from cogmap.services.codelets.mapping.evidence import weights_of


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task if a recalled map waits to be joined, and no correction to be applied."""
    if RECOLLECTION_ID not in graph.nodes or CORRECTION_ID in graph.nodes:
        return []
    return [context.task(CODELET.name, about=[RECOLLECTION_ID])]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Move what is known into the recalled map's frame, and add the recalled map to it."""
    recalled = graph.get(Recollection, RECOLLECTION_ID)
    root = graph.get(Map, ROOT_MAP)
    if recalled is None or root is None:
        raise MessageError(f"task {task.task_id}: the map was joined before")

    # A correction that moves everything into the recalled map's frame, in which the present one has
    # this pose.
    pose = np.array([recalled.x_m, recalled.y_m, recalled.heading_rad])
    row = np.zeros((1, len(CorrectionColumn)))
    row[0, CorrectionColumn.NEW_X_M :] = pose
    operations: list[Operation] = [DropNode(id=RECOLLECTION_ID)]
    operations.append(msgspec.structs.replace(root, remembered=recalled.map))
    operations += moved(graph, row)

    for goal in graph.of_kind(Goal):
        if not goal.object and goal.map == ROOT_MAP:
            ((x_m, y_m),) = transform_from(pose, np.array([[goal.x_m, goal.y_m]])).tolist()
            operations.append(msgspec.structs.replace(goal, x_m=x_m, y_m=y_m))

    # The plan is driven until there is a better one. It is written as one that was made just
    # before, so that one made in this very cycle is newer.
    plan = graph.get(Plan, PLAN_ID)
    if plan is not None and plan.map == ROOT_MAP:
        route = None
        if plan.route is not None:
            route_m = np.asarray(plan.route.numpy(), np.float64)
            route = Matrix.of(transform_from(pose, route_m))
        planned_ns = task.stamp_ns - 1
        operations.append(msgspec.structs.replace(plan, route=route, planned_ns=planned_ns))

    known = recalled_objects(recalled, graph, pose)
    operations += known
    objects = [each for each in known if isinstance(each, Object)]
    operations += recalled_sub_maps(recalled, objects, graph, pose)
    operations += recalled_places(recalled)
    return Answer(operations)


MOVED: tuple[type[GraphNode], ...] = (PathSegment, Self, Object, Map, Goal, Plan)

CODELET = Codelet(
    name="join_map",
    phase=Phase.CORRECTION,
    due=due,
    run=run,
    reads=frozenset({*MOVED, Recollection, Observations, LinkKind.WITHIN, *MOVED_COLUMNS}),
    writes=frozenset({*MOVED, Recollection, LinkKind.AT, LinkKind.WITHIN, *MOVED_COLUMNS}),
)


def recalled_places(recalled: Recollection) -> Iterator[Operation]:
    """Return what is known of the recalled place nodes, and the weights of their links by the
    evidence.
    """
    weight_of = dict(zip(EVIDENCE_COLUMNS, WEIGHT_COLUMNS, strict=True))
    corners = np.array(recalled.tiles).reshape(-1, 2) * TILE_SIDE
    for column, matrix in recalled.columns.items():
        every = np.asarray(matrix.numpy(), np.float32)
        tile, number = np.nonzero(every)
        i, j = np.divmod(number, TILE_SIDE)
        cells = corners[tile] + np.column_stack([i, j])
        values = every[tile, number]

        yield from written_cells(column, cells, values)
        if column in weight_of:
            yield from written_cells(weight_of[column], cells, weights_of(values))
