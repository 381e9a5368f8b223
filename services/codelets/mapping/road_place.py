"""The road-place codelet: place nodes that are seen as road, and the one that the agent is at
(paper §5.2).

How much a place node is road follows from the last few views of it. What was taken for road is
withdrawn where later views show other ground there.
"""

from __future__ import annotations

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.array import Array
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Cells, Operation, Phase
from cogmap.schemas.nodes import SELF_ID, PlaceColumn, Self
from cogmap.services.codelets.mapping.evidence import blended
from cogmap.services.codelets.mapping.local_grid import LocalGrid
from cogmap.services.codelets.mapping.rays import clear_cells, rays_of

ROAD_REACH_M = 12.0
ENOUGH_POINTS = 3
# Nearer ground is below the image, and of farther ground too few points are seen to miss any.
NOT_ROAD_M = (3.0, 8.0)


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """One task in each cycle."""
    task = context.task(CODELET.name, about=[SELF_ID], with_road=True, with_scan=True)
    return [task]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Activate the place node that the agent is at, and mark those near it that it sees as road."""
    agent = graph.agent
    if agent is None or task.road_m is None:
        raise MessageError(f"task {task.task_id}: no self node, or no road points")

    grid = LocalGrid.around(agent, graph.cell_m(agent.map), ROAD_REACH_M)
    operations: list[Operation] = [_activated(grid, task.cycle)]
    if not agent.misfits.is_lost and task.road_m.shape[0]:
        window = graph.places.window(agent.map, [PlaceColumn.ROAD], grid.extent)
        after = _road(task.road_m, task.scan, grid, window.values)
        operations += grid.changed(window.columns, window.values, after)

    return Answer(operations)


CODELET = Codelet(
    name="road_place",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self, PlaceColumn.ROAD}),
    writes=frozenset({PlaceColumn.ACTIVATION, PlaceColumn.ROAD}),
)


def _activated(grid: LocalGrid, cycle: int) -> Cells:
    """The activation of the place node that the agent is at."""
    position_m = grid.pose[None, :2]
    here = np.rint(position_m / grid.cell_m).astype(np.int32)
    full = np.ones(1, np.float32)

    return Cells(
        map=grid.map_id,
        column=PlaceColumn.ACTIVATION,
        cells=Array.of(here),
        values=Array.of(full),
        cycle=cycle,
    )


def _road(road: Array, scan: Array | None, grid: LocalGrid, before: Singles) -> Singles:
    """(1, w, h): how much the cells are road after this view, `before` being how much they were."""
    road_m = np.asarray(road.numpy(), np.float64)
    range_m = np.hypot(road_m[:, 0], road_m[:, 1])
    near_m = road_m[range_m < ROAD_REACH_M]
    points = grid.counts(grid.positions(near_m))
    shares = np.minimum(1.0, points / ENOUGH_POINTS)

    is_in_view = (points > 0) | _is_missed(road_m, scan, grid)
    certainty = grid.certainty(grid.range_m())
    return blended(before, shares, np.where(is_in_view, certainty, 0.0))


def _is_missed(road_m: Floats, scan: Array | None, grid: LocalGrid) -> Booleans:
    """(w, h): the cells that are in view, and where road would be seen if there were any."""
    rays = rays_of(scan, road_m, grid)
    range_m = grid.range_m()
    nearest_m, farthest_m = NOT_ROAD_M
    is_at_range = (range_m >= nearest_m) & (range_m <= farthest_m)
    return clear_cells(rays, grid) & is_at_range
