"""The charging-place codelet: where a need is eased, there is something that eases it.

Perception may not know what that looks like: the agent remembers where it stood.
"""

from __future__ import annotations

import math

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Link, Phase
from cogmap.schemas.nodes import (
    SATISFIED_BY,
    SELF_ID,
    LinkKind,
    Need,
    Object,
    Self,
    individual_label,
    nearest_place,
    object_id,
)

LOOK = "charging-place"
# As near to it the agent is charged as well by the one that it knows.
SAME_M = 8.0
SD_M = 2.0
MAX_PLACES = 64


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """One task where a need is eased, and nothing is known nearby that eases it."""
    agent = graph.agent
    if agent is None or agent.misfits.is_lost or not _unexplained(agent, graph):
        return []
    return [context.task(CODELET.name, about=[SELF_ID])]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """An object where the agent stands that eases each need that is eased. What was felt is known
    for good: its base level is the highest.
    """
    agent = graph.agent
    if agent is None or agent.misfits.is_lost:
        return Answer()

    answer = Answer()
    for function in _unexplained(agent, graph):
        label = _unused_label(graph)
        if not label:
            continue

        node = Object(
            id=object_id(label),
            base_level=1.0,
            activation=1.0,
            cycle=task.cycle,
            label=label,
            function=function,
            map=agent.map,
            x_m=agent.x_m,
            y_m=agent.y_m,
            x_sd_m=SD_M + agent.x_sd_m,
            y_sd_m=SD_M + agent.y_sd_m,
            last_seen_ns=task.stamp_ns,
            created_ns=task.stamp_ns,
        )
        place = nearest_place(node.x_m, node.y_m, graph.cell_m(node.map), node.map)
        answer.operations.append(node)
        answer.operations.append(Link(source=node.id, target=place, kind=LinkKind.AT))

    return answer


CODELET = Codelet(
    name="charging_place",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self, Need, Object}),
    writes=frozenset({Object, LinkKind.AT}),
)


def _unexplained(agent: Self, graph: Graph) -> list[str]:
    """The functions that ease a need now, where no object nearby has them."""
    functions = []
    for need in graph.of_kind(Need):
        function = SATISFIED_BY.get(need.label, "")
        if need.is_eased and function and not _is_known(function, agent, graph):
            functions.append(function)

    return functions


def _is_known(function: str, agent: Self, graph: Graph) -> bool:
    for node in graph.of_kind(Object):
        is_here = node.function == function and node.map == agent.map
        if is_here and math.dist((node.x_m, node.y_m), (agent.x_m, agent.y_m)) <= SAME_M:
            return True

    return False


def _unused_label(graph: Graph) -> str:
    """The label of an individual that the map lacks; empty where it has MAX_PLACES of them."""
    for number in range(1, MAX_PLACES + 1):
        label = individual_label(LOOK, number)
        if object_id(label) not in graph.nodes:
            return label

    return ""
