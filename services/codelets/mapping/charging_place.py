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

NAME = "charging-place"
ORIGIN = "charge"
# From as near, the one that is known charges as well.
SAME_M = 8.0
# The standard deviation of how far it stands from the agent that it charges.
SD_M = 2.0


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task if a need is eased, and nothing is known nearby that eases it."""
    agent = graph.agent
    if agent is None or agent.misfits.is_lost or not _unexplained(agent, graph):
        return []
    return [context.task(CODELET.name, about=[SELF_ID])]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Add an object where the agent stands for each need that is eased there; the object eases it.
    What was felt is known for good: the object's base level is the highest.
    """
    agent = graph.agent
    if agent is None or agent.misfits.is_lost:
        return Answer()

    answer = Answer()
    for number, function in enumerate(_unexplained(agent, graph)):
        label = individual_label(task.cycle, number, ORIGIN)
        node = Object(
            id=object_id(label),
            base_level=1.0,
            activation=1.0,
            cycle=task.cycle,
            label=label,
            names={NAME: 1.0},
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
    """Return the functions that ease a need now, if no object nearby has them."""
    eased = [SATISFIED_BY.get(need.label, "") for need in graph.of_kind(Need) if need.is_eased]
    functions = [function for function in eased if function]
    # Few needs are ever eased, and a map may have many objects.
    if not functions:
        return []

    here_m = (agent.x_m, agent.y_m)
    near = set()
    for node in graph.of_kind(Object):
        if node.map == agent.map and math.dist((node.x_m, node.y_m), here_m) <= SAME_M:
            near.add(node.function)

    return [function for function in functions if function not in near]
