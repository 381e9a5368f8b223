"""An attention codelet: where the agent is among what it sees."""

from __future__ import annotations

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from schemas.codelets import Task
from schemas.graph import Phase
from schemas.nodes import SELF_ID, AnyNode, Object, Self
from services.codelets.attention.coalitions import coalition, objects_in_view
from services.codelets.config import SECTION, Config


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task in each cycle."""
    percepts = context.percepts.objects
    task = context.task(CODELET.name, about=[SELF_ID], percepts=percepts)
    return [task]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """A coalition of the self and the objects in view."""
    nodes: list[AnyNode] = []
    if graph.agent is not None:
        nodes.append(graph.agent)
    nodes += objects_in_view(task.percepts, graph)
    if not nodes:
        return Answer()

    found = coalition(CODELET.name, nodes, graph, config.attention_base_level)
    return Answer(coalitions=[found])


CODELET = Codelet(
    name="whereabouts",
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Self, Object}),
    writes=frozenset(),
    config=Config,
    section=SECTION,
)
