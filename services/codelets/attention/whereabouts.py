"""The default attention codelet: where the agent is among what it sees, the most active content of
the Current Situational Model.

Without it nothing would be conscious wherever nothing happens, and no action chosen: so it has no
refractory period, where LIDA's attention codelets have one of 50 ticks.
"""

from __future__ import annotations

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import SELF_ID, AnyNode, Object, Self
from cogmap.services.codelets.attention.coalitions import coalition, objects_in_view

NAME = "whereabouts"


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task in each cycle."""
    return [context.task(NAME, about=[SELF_ID], percepts=context.percepts.objects)]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Bring a coalition of the self and the objects in view."""
    nodes: list[AnyNode] = []
    if graph.agent is not None:
        nodes.append(graph.agent)
    nodes += objects_in_view(task.percepts, graph)
    if not nodes:
        return Answer()

    return Answer(coalitions=[coalition(NAME, nodes, graph, percepts=task.percepts)])


CODELET = Codelet(
    name=NAME,
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Self, Object}),
    writes=frozenset(),
)
