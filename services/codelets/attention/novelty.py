"""An attention codelet: what is new to the agent in view."""

from __future__ import annotations

import msgspec

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from schemas.codelets import Task
from schemas.graph import Phase
from schemas.nodes import SELF_ID, AnyNode, Object, Self
from schemas.sensing import Percept
from services.codelets.attention.coalitions import coalition, objects_in_view
from services.codelets.config import SECTION, Config

NOVEL_SIGHTINGS = 5


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task where an object in view has been seen in few views."""
    percepts = context.percepts.objects
    if not novel_objects(percepts, graph):
        return []

    return [context.task(CODELET.name, about=[SELF_ID], percepts=percepts)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """A coalition of the self and the novel objects in view."""
    novel = novel_objects(task.percepts, graph)
    if not novel or graph.agent is None:
        return Answer()

    nodes: list[AnyNode] = [graph.agent, *novel]

    found = coalition(CODELET.name, nodes, graph, config.attention_base_level)
    return Answer(coalitions=[found])


CODELET = Codelet(
    name="novelty",
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Self, Object}),
    writes=frozenset(),
    config=Config,
    section=SECTION,
)


def novel_objects(percepts: list[Percept], graph: Graph) -> list[Object]:
    """The objects in view that were seen in few views, each as salient as it was seen little."""
    found = []
    for node in objects_in_view(percepts, graph):
        if node.sightings <= NOVEL_SIGHTINGS:
            salience = 1.0 - node.sightings / (NOVEL_SIGHTINGS + 1)
            found.append(msgspec.structs.replace(node, salience=salience))

    return found
