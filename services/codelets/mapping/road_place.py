"""The road-place codelet: place nodes that are seen as road, and the one that the agent is at
(paper §5.2).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import mean_pose, transform_from
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from schemas.array import Array
from schemas.codelets import Task
from schemas.graph import Cells, Phase
from schemas.nodes import SELF_ID, PlaceColumn, Self
from services.codelets.config import SECTION, Config

ROAD_REACH_M = 12.0
ENOUGH_POINTS = 3

Cell32 = npt.NDArray[np.int32]
Share32 = npt.NDArray[np.float32]


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task in each cycle."""
    task = context.task(CODELET.name, about=[SELF_ID], with_road=True)
    return [task]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Mark the place nodes near the agent that it sees as road, and activate the one it is at."""
    agent = graph.agent
    if agent is None or task.road_m is None:
        raise MessageError(f"task {task.task_id}: no self node, or no road points")

    pose = mean_pose(agent.samples.numpy())
    cell_m = graph.cell_m(agent.map)
    active = _activated(agent.map, pose, cell_m, task.cycle)

    cells, shares = _road_cells(task.road_m, pose, cell_m)
    if not len(cells):
        return Answer([active])

    return Answer([active, _road(agent.map, cells, shares)])


CODELET = Codelet(
    name="road_place",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self}),
    writes=frozenset({PlaceColumn.ACTIVATION, PlaceColumn.ROAD}),
    config=Config,
    section=SECTION,
)


def _activated(map_id: str, pose: Floats, cell_m: float, cycle: int) -> Cells:
    """The activation of the place node at `pose`."""
    position_m = pose[None, :2]
    here = np.rint(position_m / cell_m).astype(np.int32)
    full = np.ones(1, np.float32)

    return Cells(
        map=map_id,
        column=PlaceColumn.ACTIVATION,
        cells=Array.of(here),
        values=Array.of(full),
        cycle=cycle,
    )


def _road(map_id: str, cells: Cell32, shares: Share32) -> Cells:
    """The place nodes at (k, 2) cells as road, by (k,) shares."""
    return Cells(
        map=map_id,
        column=PlaceColumn.ROAD,
        cells=Array.of(cells, "<i4"),
        values=Array.of(shares),
    )


def _near_m(points_m: Array) -> Floats:
    """(k, 2): the points within reach, of (n, 2) in the robot's frame."""
    points = np.asarray(points_m.numpy(), np.float64)
    seen_m = points.reshape(-1, 2)

    range_m = np.hypot(seen_m[:, 0], seen_m[:, 1])
    near_m: Floats = seen_m[range_m < ROAD_REACH_M]
    return near_m


def _road_cells(points_m: Array, pose: Floats, cell_m: float) -> tuple[Cell32, Share32]:
    """(k, 2) cells that are seen as road by (n, 2) points in the robot's frame, and how much, (k,),
    0 to 1.
    """
    on_map_m = transform_from(pose, _near_m(points_m))
    seen_cells = np.rint(on_map_m / cell_m).astype(np.int32)

    cells, counts = np.unique(seen_cells, axis=0, return_counts=True)
    shares = np.minimum(1.0, counts / ENOUGH_POINTS)
    return cells, shares.astype(np.float32)
