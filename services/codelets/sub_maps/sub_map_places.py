"""The sub-map-places codelet: the place nodes of each sub-map, in its own frame and on its own
grid, from those of the root map (paper §5.2, §5.3).

It runs beside the cycle. A task makes anew what is around the agent, and one block of one sub-map,
another each time: what a corrected map moved is up to date again after a while. A sub-map has no
places before its frame has settled, and those that just have get a block of their own.
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import ROOT_MAP, SELF_ID, Map, Self
from cogmap.services.codelets.sub_maps.coarse_places import REACH_M
from cogmap.services.codelets.sub_maps.resampling import COLUMNS
from cogmap.services.codelets.sub_maps.sub_map_grid import (
    SETTLED_CYCLES,
    any_with_places,
    block,
    block_count,
    cells_around,
    updated,
    with_places,
)

# An update takes a worker for some cycles.
EVERY_CYCLES = 10
NEW_TURNS = 8
"""For so many turns sub-maps that have settled count as new."""


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task every EVERY_CYCLES, if sub-maps have settled."""
    # Coarse maps have their turn in other cycles: a worker that is long at work gets no more.
    is_time = context.cycle % EVERY_CYCLES == EVERY_CYCLES // 3
    if graph.agent is None or not is_time or not any_with_places(graph, context.cycle):
        return []
    return [context.task(CODELET.name, about=[SELF_ID])]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Update the places of sub-maps that have changed."""
    agent = graph.agent
    if agent is None:
        raise MessageError(f"task {task.task_id}: the graph has no self node")

    maps = with_places(graph, task.cycle)
    new_cycles = SETTLED_CYCLES + NEW_TURNS * EVERY_CYCLES
    new = [node for node in maps if task.cycle - node.cycle <= new_cycles]
    turns = [maps] if len(new) == len(maps) else [maps, new]

    answer = Answer()
    turn = task.cycle // EVERY_CYCLES
    for some in turns:
        if some:
            number, index = divmod(turn, len(some))
            node = some[index]
            chosen = block(node, number % block_count(node, graph), graph)
            answer.operations.extend(updated(node, chosen, graph))
    if agent.map == ROOT_MAP:
        here_m = np.array([agent.x_m, agent.y_m])
        for node in maps:
            away_m = math.hypot(agent.x_m - node.x_m, agent.y_m - node.y_m)
            if away_m <= REACH_M + math.hypot(node.width_m, node.height_m) / 2:
                near = cells_around(node, here_m, REACH_M)
                answer.operations.extend(updated(node, near, graph))

    return answer


def make_all(graph: Graph, cycle: int) -> None:
    """Give a graph all places that its sub-maps have in a cycle at once, as they are in one that
    was long at work.
    """
    for node in with_places(graph, cycle):
        for number in range(block_count(node, graph)):
            graph.change(updated(node, block(node, number, graph), graph))


CODELET = Codelet(
    name="sub_map_places",
    phase=Phase.BACKGROUND,
    due=due,
    run=run,
    reads=frozenset({Self, Map, *COLUMNS}),
    writes=frozenset(COLUMNS),
)
