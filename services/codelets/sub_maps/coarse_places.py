"""The coarse-places codelet: the root map's place nodes on coarser grids too, one map each (paper
§5.2: several maps of different resolution).

It runs beside the cycle. A task makes anew what is around the agent, and one block of the whole
map, another each time: what a corrected map moved is up to date again after a while.
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.graph.window import WEIGHT_COLUMNS, Extent
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Operation, Phase
from cogmap.schemas.nodes import ROOT_MAP, SELF_ID, Map, PlaceColumn, Self, coarse_map_id
from cogmap.services.codelets.cells import changed_cells
from cogmap.services.codelets.sub_maps.coarsening import (
    FACTOR,
    MARGIN,
    coarser,
    places_of,
)

# An update takes a worker for some cycles.
EVERY_CYCLES = 5
# The distance from the agent within which the root map changes as it looks around.
REACH_M = 30.0
# Three levels with the root map, as the planner by the paper's first author has (§5.5).
LEVELS = 2
CELLS = FACTOR**LEVELS
"""The cells of the root map along the side of the coarsest map's cell."""

BLOCK = 16
"""The cells of the coarsest map along the side of a block."""

COARSE = (PlaceColumn.ROAD, *WEIGHT_COLUMNS)
COLUMNS = (*COARSE, PlaceColumn.OBSTACLE)


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task every EVERY_CYCLES."""
    if graph.agent is None or context.cycle % EVERY_CYCLES:
        return []
    return [context.task(CODELET.name, about=[SELF_ID])]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Update the coarse places that have changed; first of all, make the maps that they are in."""
    agent = graph.agent
    if agent is None:
        raise MessageError(f"task {task.task_id}: the graph has no self node")

    missing = _missing(graph)
    if missing:
        return Answer(missing)

    answer = Answer()
    blocks = _blocks(graph.places.extent(ROOT_MAP))
    if blocks:
        turn = task.cycle // EVERY_CYCLES
        answer.operations.extend(_update(graph, blocks[turn % len(blocks)]))
    if agent.map == ROOT_MAP:
        side_m = graph.cell_m(ROOT_MAP) * CELLS
        here_m = np.array([agent.x_m, agent.y_m])
        first_i, first_j = np.floor((here_m - REACH_M) / side_m).astype(int).tolist()
        last_i, last_j = np.ceil((here_m + REACH_M) / side_m).astype(int).tolist()
        around = Extent((first_i, first_j), (last_i + 1, last_j + 1))
        answer.operations.extend(_update(graph, around))

    return answer


def make_all(graph: Graph) -> None:
    """Give a graph all of its coarse maps at once, as they are in one that was long at work."""
    graph.change(_missing(graph))
    for block in _blocks(graph.places.extent(ROOT_MAP)):
        graph.change(_update(graph, block))


CODELET = Codelet(
    name="coarse_places",
    phase=Phase.BACKGROUND,
    due=due,
    run=run,
    reads=frozenset({Self, Map, *COLUMNS}),
    writes=frozenset({Map, *COARSE}),
)


def _missing(graph: Graph) -> list[Operation]:
    """Make the nodes of the coarse maps that do not exist yet."""
    missing: list[Operation] = []
    for level in range(1, LEVELS + 1):
        identifier = coarse_map_id(level)
        if graph.get(Map, identifier) is None:
            cell_m = graph.cell_m(ROOT_MAP) * FACTOR**level
            missing.append(Map(id=identifier, base_level=1.0, cell_m=cell_m, parent=ROOT_MAP))

    return missing


def _blocks(extent: Extent) -> list[Extent]:
    """Return the blocks of the coarsest map, in its cells, that cover an extent of the root map."""
    side = CELLS * BLOCK
    blocks = []
    for i in range(extent.lower[0] // side, math.ceil(extent.upper[0] / side)):
        for j in range(extent.lower[1] // side, math.ceil(extent.upper[1] / side)):
            blocks.append(Extent((i * BLOCK, j * BLOCK), ((i + 1) * BLOCK, (j + 1) * BLOCK)))

    return blocks


def _update(graph: Graph, coarsest: Extent) -> list[Operation]:
    """Write the cells that change on all levels, in a rectangle of cells of the coarsest one."""
    # Each level needs the finer cells below its own, with a margin.
    extents = [coarsest]
    margin = FACTOR // 2 + MARGIN
    for _ in range(LEVELS):
        (low_i, low_j), (high_i, high_j) = extents[0].lower, extents[0].upper
        finer = Extent(
            (FACTOR * low_i - margin, FACTOR * low_j - margin),
            (FACTOR * high_i - FACTOR // 2 + MARGIN, FACTOR * high_j - FACTOR // 2 + MARGIN),
        )
        extents.insert(0, finer)

    window = graph.places.window(ROOT_MAP, COLUMNS, extents[0])
    places = places_of(
        window.column(PlaceColumn.ROAD), window.column(PlaceColumn.OBSTACLE), window.weights()
    )
    operations: list[Operation] = []
    for level, extent in enumerate(extents[1:], start=1):
        places = coarser(places)
        identifier = coarse_map_id(level)
        known = graph.places.window(identifier, COARSE, extent)
        after = np.concatenate([places.road[None], places.is_open.astype(np.float32)])
        operations += changed_cells(identifier, known, after)

    return operations
