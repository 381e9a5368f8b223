"""An attention codelet: what is new to the agent in view."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.codelets import Task
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import SELF_ID, AnyNode, Attention, Object, Self
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.attention.coalitions import coalition, objects_in_view
from cogmap.services.codelets.attention.pending import brought, is_refractory, memory_of

NAME = "novelty"
SECTION = NAME


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The views after which nothing is new to the agent."""

    novel_sightings: Annotated[
        int,
        Meta(
            ge=1,
            le=10_000,
            description="Views in which an object has been seen at most while it is new.",
        ),
    ] = 5


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task if an object in view has been seen in few views, and the codelet does not
    wait.
    """
    if is_refractory(NAME, graph, context.cycle):
        return []

    percepts = context.percepts.objects
    if not novel_objects(percepts, graph, config):
        return []

    return [context.task(NAME, about=[SELF_ID], percepts=percepts)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Bring a coalition of the self and the novel objects in view."""
    novel = novel_objects(task.percepts, graph, config)
    if not novel or graph.agent is None:
        return Answer()

    nodes: list[AnyNode] = [graph.agent, *novel]
    found = coalition(NAME, nodes, graph, percepts=task.percepts, feeling=Feeling.NOVELTY)
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


def novel_objects(percepts: list[Percept], graph: Graph, config: Config) -> list[Object]:
    """Return the objects in view that were seen in few views: the fewer, the more salient."""
    found = []
    for node in objects_in_view(percepts, graph):
        if node.sightings <= config.novel_sightings:
            salience = 1.0 - node.sightings / (config.novel_sightings + 1)
            found.append(msgspec.structs.replace(node, salience=salience))

    return found
