"""An attention codelet: the open goals and the plan towards them, all the more where these have
changed.
"""

from __future__ import annotations

import msgspec

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas import nodes
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Link, Phase
from cogmap.schemas.nodes import (
    NEVER_NS,
    PLAN_ID,
    SELF_ID,
    AnyNode,
    Attention,
    LinkKind,
    Plan,
    PlanState,
    Self,
)
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

NAME = "goal"
# Goals and plans last for minutes: once a second is enough.
REFRACTORY_CYCLES = 4
# The salience of a plan that is new, and of a goal reached.
CHANGE_SALIENCE = 0.5


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task if there is a route to a goal or frontier, or a plan or goal has changed, and
    the codelet does not wait.
    """
    if is_refractory(NAME, graph, context.cycle, REFRACTORY_CYCLES):
        return []

    plan = graph.get(Plan, PLAN_ID)
    is_under_way = plan is not None and plan.state is PlanState.READY
    memory = memory_of(NAME, graph)
    if not is_under_way and not memory.pending and _state(graph) == memory.noted:
        return []

    return [context.task(NAME, about=[SELF_ID, PLAN_ID])]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Bring a coalition of the self, the plan and its next goal, and the goals reached."""
    agent = graph.agent
    plan = graph.get(Plan, PLAN_ID)
    if agent is None:
        return Answer()

    # What has changed since it was noted is pending, and what is no more is not.
    memory = without_conscious(memory_of(NAME, graph))
    state = _state(graph)
    changed = [name for name in state if memory.noted.get(name) != state[name]]
    pending = {name: cycle for name, cycle in memory.pending.items() if name in state}
    memory = msgspec.structs.replace(memory, noted=state, pending=pending)
    memory = with_pending(memory, changed)

    content: list[AnyNode] = [agent]
    if plan is not None and (plan.state is PlanState.READY or PLAN_ID in memory.pending):
        content.append(plan)
        content += nodes_of(graph, nodes.Goal, plan.goals[:1])

    named = {node.id for node in content}
    reached = [name for name in memory.pending if name not in named]
    content += nodes_of(graph, nodes.Goal, reached)
    if len(content) == 1:
        return kept(memory, graph)

    names = {node.id for node in content}
    salient = [
        felt(node, CHANGE_SALIENCE) if node.id in memory.pending else node for node in content
    ]
    links = []
    target = graph.links.target(PLAN_ID, LinkKind.TOWARDS)
    if target is not None and {PLAN_ID, target} <= names:
        links.append(Link(source=PLAN_ID, target=target, kind=LinkKind.TOWARDS))

    found = coalition(NAME, salient, graph, links)
    return brought(memory, found, task.cycle, graph)


CODELET = Codelet(
    name=NAME,
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Self, nodes.Goal, Plan, Attention, LinkKind.TOWARDS}),
    writes=frozenset({Attention}),
)


def _state(graph: Graph) -> dict[str, int]:
    """Return when the plan was made, and when each goal was reached, by id."""
    state = {}
    plan = graph.get(Plan, PLAN_ID)
    if plan is not None:
        state[PLAN_ID] = max(0, plan.planned_ns)

    for goal in graph.of_kind(nodes.Goal):
        if goal.reached_ns != NEVER_NS:
            state[goal.id] = goal.reached_ns

    return state
