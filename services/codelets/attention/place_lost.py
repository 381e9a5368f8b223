"""An attention codelet: the agent does not know where it is, or knows it again."""

from __future__ import annotations

import msgspec

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.codelets import Task
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import SELF_ID, AnyNode, Attention, Object, Self, object_id
from cogmap.services.codelets.attention.coalitions import coalition, felt
from cogmap.services.codelets.attention.pending import (
    brought,
    is_refractory,
    kept,
    memory_of,
    with_pending,
    without_conscious,
)
from cogmap.services.codelets.nodes import nodes_of

NAME = "place_lost"
LOST = "lost"


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task while the agent is lost, and until it is conscious that it is found again."""
    agent = graph.agent
    if agent is None:
        return []
    if is_refractory(NAME, graph, context.cycle):
        return []

    memory = memory_of(NAME, graph)
    is_known = (LOST in memory.noted) == agent.misfits.is_lost and not memory.pending
    if is_known and not agent.misfits.is_lost:
        return []

    return [context.task(NAME, about=[SELF_ID])]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Bring a coalition of the self and, while it is lost, of the landmark that did not fit first:
    it is bad to be lost, and good to be found.
    """
    agent = graph.agent
    if agent is None:
        return Answer()

    memory = without_conscious(memory_of(NAME, graph))
    was_lost = LOST in memory.noted
    if was_lost != agent.misfits.is_lost:
        noted = {LOST: task.cycle} if agent.misfits.is_lost else {}
        memory = with_pending(msgspec.structs.replace(memory, noted=noted), [SELF_ID])
    if not memory.pending and not agent.misfits.is_lost:
        return kept(memory, graph)

    if agent.misfits.is_lost:
        content: list[AnyNode] = [agent]
        content += nodes_of(graph, Object, [object_id(agent.misfits.label)])
        bad = [felt(node, -1.0) for node in content]
        found = coalition(NAME, bad, graph, feeling=Feeling.LOST)
    else:
        found = coalition(NAME, [felt(agent, 1.0)], graph)
    return brought(memory, found, task.cycle, graph)


CODELET = Codelet(
    name=NAME,
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Self, Object, Attention}),
    writes=frozenset({Attention}),
)
