"""An attention codelet: an episode that long-term memory was reminded of here."""

from __future__ import annotations

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas import nodes
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import SELF_ID, Attention, Self
from cogmap.services.codelets.attention.coalitions import coalition
from cogmap.services.codelets.attention.pending import brought, is_refractory, memory_of

NAME = "episode"
# The node of an episode decays within as many cycles: it is brought once.
REFRACTORY_CYCLES = 10


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task if an episode was recalled just now, and the codelet does not wait."""
    if is_refractory(NAME, graph, context.cycle, REFRACTORY_CYCLES):
        return []

    recalled = recalled_episodes(graph)
    if not recalled:
        return []

    return [context.task(NAME, about=[SELF_ID, *(node.id for node in recalled)])]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Bring a coalition of the self and the most active episode, as salient as that is."""
    agent = graph.agent
    recalled = recalled_episodes(graph)
    if agent is None or not recalled:
        return Answer()

    best = max(recalled, key=lambda node: (graph.activation(node), node.number))
    found = coalition(NAME, [agent, best], graph)
    return brought(memory_of(NAME, graph), found, task.cycle, graph)


CODELET = Codelet(
    name=NAME,
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Self, nodes.Episode, Attention}),
    writes=frozenset({Attention}),
)


def recalled_episodes(graph: Graph) -> list[nodes.Episode]:
    """Return the episodes whose activation has not decayed since they were recalled, by id."""
    return [node for node in graph.of_kind(nodes.Episode) if graph.activation(node) > 0.0]
