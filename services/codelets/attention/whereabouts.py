"""The default attention codelet: where the agent is among what it sees, the most active content of
the Current Situational Model.
"""

from __future__ import annotations

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import SELF_ID, AnyNode, Attention, Object, Self
from cogmap.services.codelets.attention.coalitions import coalition, objects_in_view
from cogmap.services.codelets.attention.config import SECTION, Config
from cogmap.services.codelets.attention.memory import brought, is_refractory, memory_of

NAME = "whereabouts"


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task in each cycle in which it does not wait."""
    if is_refractory(NAME, graph, context.cycle, config.whereabouts.refractory_cycles):
        return []

    return [context.task(NAME, about=[SELF_ID], percepts=context.percepts.objects)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """A coalition of the self and the objects in view."""
    nodes: list[AnyNode] = []
    if graph.agent is not None:
        nodes.append(graph.agent)
    nodes += objects_in_view(task.percepts, graph)
    if not nodes:
        return Answer()

    base_level = config.whereabouts.base_level
    found = coalition(NAME, nodes, graph, base_level, percepts=task.percepts)
    if not config.whereabouts.refractory_cycles:
        return Answer(coalitions=[found])
    return brought(memory_of(NAME, graph), found, task.cycle, graph)


CODELET = Codelet(
    name=NAME,
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Self, Object, Attention}),
    writes=frozenset({Attention}),
    config=Config,
    section=SECTION,
)
