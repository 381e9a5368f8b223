"""The road-place codelet: place nodes that are seen as road, and the one that the agent is at
(paper §5.2).

How much a place node is road follows from the last few views of it. What was taken for road is
withdrawn if later views show other ground there.
"""

from __future__ import annotations

import numpy as np

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.array import Array
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Cells, Phase
from cogmap.schemas.nodes import SELF_ID, PlaceColumn, Self
from cogmap.services.codelets.mapping.evidence import blended
from cogmap.services.codelets.mapping.local_grid import LocalGrid
from cogmap.services.codelets.mapping.rays import clear_cells, rays_of

# Less than the 15 m up to which perception sees road.
ROAD_REACH_M = 12.0
# A place node, 1 m wide, has about four points at most: perception has one in each 0.5 m.
ENOUGH_POINTS = 3
# Nearer ground is below the image, and of farther ground too few points are seen to miss any.
NOT_ROAD_M = (3.0, 8.0)


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task in each cycle."""
    task = context.task(CODELET.name, about=[SELF_ID], with_road=True, with_scan=True)
    return [task]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Activate the place node that the agent is at, and mark those near it that it sees as road."""
    agent = graph.agent
    if agent is None or task.road_m is None:
        raise MessageError(f"task {task.task_id}: no self node, or no road points")

    grid = LocalGrid.around(agent, graph.cell_m(agent.map), ROAD_REACH_M)
    here = np.rint(grid.eye).astype(np.int32)
    activated = Cells(
        map=grid.map_id,
        column=PlaceColumn.ACTIVATION,
        cells=Array.of(here[None]),
        values=Array.of(np.ones(1, np.float32)),
        cycle=task.cycle,
    )
    if agent.misfits.is_lost or not task.road_m.shape[0]:
        return Answer([activated])

    road_m = np.asarray(task.road_m.numpy(), np.float64)
    near_m = road_m[np.hypot(road_m[:, 0], road_m[:, 1]) < ROAD_REACH_M]
    points = grid.counts(grid.positions(near_m))
    shares = np.minimum(1.0, points / ENOUGH_POINTS)

    # Where rays pass, not too near or far, road would be seen if there were any.
    range_m = grid.range_m()
    nearest_m, farthest_m = NOT_ROAD_M
    is_at_range = (range_m >= nearest_m) & (range_m <= farthest_m)
    is_missed = clear_cells(rays_of(task.scan, road_m, grid), grid) & is_at_range
    certainty = np.where((points > 0) | is_missed, grid.certainty(range_m), 0.0)

    window = graph.places.window(agent.map, [PlaceColumn.ROAD], grid.extent)
    after = blended(window.values, shares, certainty)
    return Answer([activated, *grid.changed(window.columns, window.values, after)])


CODELET = Codelet(
    name="road_place",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self, PlaceColumn.ROAD}),
    writes=frozenset({PlaceColumn.ACTIVATION, PlaceColumn.ROAD}),
)
