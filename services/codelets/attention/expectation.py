"""An attention codelet: what was expected and is not so. A building of the map is gone, or a street
is closed that the plan counts on or the agent drove along.
"""

from __future__ import annotations

import math

import msgspec

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.codelets import Task
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Link, Phase
from cogmap.schemas.nodes import (
    PLAN_ID,
    SELF_ID,
    AnyNode,
    Attention,
    LinkKind,
    Object,
    PathSegment,
    PlaceColumn,
    Plan,
    Self,
    object_id,
    place_cell,
)
from cogmap.services.codelets.attention.closure import closed_places, expected_by, is_known
from cogmap.services.codelets.attention.coalitions import coalition, felt
from cogmap.services.codelets.attention.config import SECTION, Config, Expectation
from cogmap.services.codelets.attention.disappearance import missing_objects
from cogmap.services.codelets.attention.memory import (
    brought,
    is_refractory,
    kept,
    memory_of,
    with_pending,
    without_conscious,
)
from cogmap.services.codelets.nodes import nodes_of

NAME = "expectation"
SURPRISE = -1.0
# Views are counted anew once the agent was so many times as far away as it can see them.
AWAY = 2.0
# What is found near where a street was closed is the same closure for so many cycles. It counts
# once it was seen in two views that are no farther apart.
SAME_CYCLES = 3000
GLIMPSE_CYCLES = 3


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task in each cycle in which the agent knows where it is and sees how far it is free."""
    agent = graph.agent
    if agent is None or agent.is_lost or context.scan is None:
        return []

    percepts = context.percepts.objects
    return [context.task(NAME, about=[SELF_ID, PLAN_ID], percepts=percepts, with_scan=True)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """A coalition of the self and what is not as expected, until it was conscious."""
    agent = graph.agent
    settings = config.expectation
    if agent is None:
        return Answer()

    memory = without_conscious(memory_of(NAME, graph))
    memory = _with_missing(memory, task, agent, graph, settings)
    memory = _with_closed(memory, task, agent, graph)
    if is_refractory(NAME, graph, task.cycle, settings.refractory_cycles):
        return kept(memory, graph)

    links = _links_to_closed(memory, graph)
    content = _surprising(memory, agent, links, graph)
    if not content:
        return kept(memory, graph)

    nodes = content if content[0].id == SELF_ID else [agent, *content]
    found = coalition(NAME, nodes, graph, settings.base_level, links, feeling=Feeling.SURPRISE)
    return brought(memory, found, task.cycle, graph)


CODELET = Codelet(
    name=NAME,
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Self, Object, Plan, PathSegment, Attention, PlaceColumn.ROAD}),
    writes=frozenset({Attention}),
    config=Config,
    section=SECTION,
)


def _with_missing(
    memory: Attention, task: Task, agent: Self, graph: Graph, settings: Expectation
) -> Attention:
    """`memory`, with the number of views in which each object was missing since it was seen last,
    or the agent was far from it. Those are pending that reach the number that is a surprise.
    """
    in_view = {object_id(percept.label) for percept in task.percepts}
    missing = missing_objects(task, agent, graph, settings)
    noted = {}
    for name, number in memory.noted.items():
        node = graph.get(Object, name)
        is_missing = name not in in_view and _is_near(node, agent, settings)
        if place_cell(name) is not None or is_missing:
            noted[name] = number

    gone = []
    for name, counts in missing.items():
        before = memory.noted.get(name, 0)
        noted[name] = min(before + counts, settings.views)
        if before < settings.views == noted[name]:
            gone.append(name)

    pending = {}
    for name, cycle in memory.pending.items():
        if name in noted:
            pending[name] = cycle

    counted = msgspec.structs.replace(memory, noted=noted, pending=pending)
    return with_pending(counted, gone)


def _is_near(node: Object | None, agent: Self, settings: Expectation) -> bool:
    """Whether an object still is where the agent may see that it is gone."""
    if node is None:
        return False

    away_m = math.dist((node.x_m, node.y_m), (agent.x_m, agent.y_m))
    return away_m <= AWAY * settings.farthest_m


def _with_closed(memory: Attention, task: Task, agent: Self, graph: Graph) -> Attention:
    """`memory`, in which places that two views in short order show closed are noted with their
    cycle, and pending, each where no closure near it is known already.
    """
    noted = {}
    for name, number in memory.noted.items():
        is_old = place_cell(name) is not None and task.cycle - number > SAME_CYCLES
        if not is_old:
            noted[name] = number

    glimpsed = {}
    for name, cycle in memory.glimpsed.items():
        if task.cycle - cycle <= GLIMPSE_CYCLES:
            glimpsed[name] = cycle

    if task.scan is None:
        raise MessageError(f"task {task.task_id}: no range scan")

    new = []
    cell_m = graph.cell_m(agent.map)
    for closed in closed_places(task.scan, agent, graph):
        if is_known(closed, noted, task.cycle - SAME_CYCLES, cell_m):
            continue
        if is_known(closed, memory.glimpsed, task.cycle - GLIMPSE_CYCLES, cell_m):
            noted[closed] = task.cycle
            new.append(closed)
        glimpsed[closed] = task.cycle

    after = msgspec.structs.replace(memory, noted=noted, glimpsed=glimpsed)
    return with_pending(after, new)


def _links_to_closed(memory: Attention, graph: Graph) -> list[Link]:
    """The links to the places where road is closed, from what counted on it."""
    links = []
    for name in sorted(memory.pending):
        if place_cell(name) is not None:
            source = expected_by(name, graph)
            links.append(Link(source=source, target=name, kind=LinkKind.BLOCKED))

    return links


def _surprising(memory: Attention, agent: Self, links: list[Link], graph: Graph) -> list[AnyNode]:
    """What is pending: the objects that are gone, and the agent or the plan where road is closed
    that it counted on.
    """
    misled = {link.source for link in links}
    content: list[AnyNode] = [agent] if SELF_ID in misled else []
    content += nodes_of(graph, Object, sorted(memory.pending))
    plan = graph.get(Plan, PLAN_ID)
    if plan is not None and PLAN_ID in misled:
        content.append(plan)

    return [felt(node, SURPRISE) for node in content]
