"""An attention codelet: a need that is high, and what is known to satisfy it."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
from msgspec import Meta

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas import nodes
from cogmap.schemas.base import PositiveShare
from cogmap.schemas.codelets import Task
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import (
    PLAN_ID,
    SATISFIED_BY,
    SELF_ID,
    AnyNode,
    Attention,
    Goal,
    Object,
    Plan,
    Self,
    goal_id,
    object_id,
)
from cogmap.services.codelets.attention.coalitions import coalition, felt
from cogmap.services.codelets.attention.pending import brought, is_refractory, memory_of

NAME = "need"
SECTION = NAME
# A need lasts for minutes: once a second is enough.
REFRACTORY_CYCLES = 4


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """When a need is high."""

    high_level: Annotated[
        PositiveShare,
        Meta(
            description="Level from which on a need is high: what is left then must suffice for "
            "the way to what satisfies it, which may be far longer than straight."
        ),
    ] = 0.4


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task if a need is high, and the codelet does not wait."""
    if is_refractory(NAME, graph, context.cycle, REFRACTORY_CYCLES):
        return []

    high = high_needs(graph, config)
    if not high:
        return []

    about = [SELF_ID, PLAN_ID, *(node.id for node in high)]
    return [context.task(NAME, about=about)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Bring a coalition of the self, the needs that are high, and the nearest object that satisfies
    each. A need that has no salience of its own is as bad as its level.
    """
    high = high_needs(graph, config)
    agent = graph.agent
    if not high or agent is None:
        return Answer()

    content: list[AnyNode] = [agent]
    for node in high:
        content.append(felt(node, node.salience or -node.level))
        satisfying = nearest_that_satisfies(node, agent, graph)
        if satisfying is not None:
            content.append(felt(satisfying, node.level))

    found = coalition(NAME, content, graph, feeling=Feeling.NEED)
    return brought(memory_of(NAME, graph), found, task.cycle, graph)


CODELET = Codelet(
    name=NAME,
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Self, Object, nodes.Need, Goal, Plan, Attention}),
    writes=frozenset({Attention}),
    config=Config,
    section=SECTION,
)


def high_needs(graph: Graph, config: Config) -> list[nodes.Need]:
    """Return the needs that are high, by id."""
    return [node for node in graph.of_kind(nodes.Need) if node.level >= config.high_level]


def nearest_that_satisfies(need: nodes.Need, agent: Self, graph: Graph) -> Object | None:
    """Find the nearest object of the agent's map that satisfies a need, as far as is known, except
    one that the plan has found no route to; None if none is known.
    """
    function = SATISFIED_BY.get(need.label)
    found = [node for node in graph.of_kind(Object) if node.function == function]

    # The goal for the need is sought in vain if the plan has no route to it.
    plan = graph.get(Plan, PLAN_ID)
    goal = graph.get(Goal, goal_id(need.label))
    unreachable = ""
    if plan is not None and goal is not None and goal.id in plan.unreachable:
        unreachable = object_id(goal.object)

    def order(node: Object) -> tuple[float, str]:
        return math.dist((node.x_m, node.y_m), (agent.x_m, agent.y_m)), node.id

    here = [node for node in found if node.map == agent.map and node.id != unreachable]
    return min(here, key=order, default=None)
