"""An attention codelet: what was expected and is not so. A building of the map is gone, or a street
is blocked that the plan leads along or the agent drove along.
"""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
from msgspec import Meta

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
from cogmap.services.codelets.attention.blockage import (
    blocked_places,
    expected_by,
    is_known,
)
from cogmap.services.codelets.attention.coalitions import coalition, felt
from cogmap.services.codelets.attention.disappearance import FARTHEST_M, missing_objects
from cogmap.services.codelets.attention.pending import (
    brought,
    is_refractory,
    kept,
    memory_of,
    with_pending,
    without_conscious,
)
from cogmap.services.codelets.nodes import nodes_of

NAME = "expectation"
SECTION = NAME
# Salience is from -1, bad, to 1: nothing is more salient.
SURPRISE = -1.0
# Views are counted anew once the agent was so many times as far away as it can see them.
AWAY = 2.0
# What is found near where a street was blocked is the same blockage for so many cycles, ten
# minutes. It counts once it was seen in two views that are no farther apart.
SAME_CYCLES = 3000
GLIMPSE_CYCLES = 3


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """When it is a surprise that an object is not in view."""

    views: Annotated[
        int,
        Meta(
            ge=1,
            le=10_000,
            description="Views in which an object is missing, since it was seen last, before that "
            "is a surprise: perception misses one of twenty. Half as many do in which "
            "the rays of the range scan pass where it stood.",
        ),
    ] = 4
    established_sightings: Annotated[
        int,
        Meta(
            ge=1,
            le=10_000,
            description="Views in which an object was seen that is expected.",
        ),
    ] = 10


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task in each cycle in which the agent knows where it is and sees how far it is
    free.
    """
    agent = graph.agent
    if agent is None or agent.misfits.is_lost or context.scan is None:
        return []

    percepts = context.percepts.objects
    return [context.task(NAME, about=[SELF_ID, PLAN_ID], percepts=percepts, with_scan=True)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Bring a coalition of the self and what is not as expected, until it was conscious."""
    agent = graph.agent
    if agent is None:
        return Answer()

    memory = without_conscious(memory_of(NAME, graph))
    memory = _with_missing(memory, task, agent, graph, config)
    memory = _with_blocked(memory, task, agent, graph)
    if not memory.pending or is_refractory(NAME, graph, task.cycle):
        return kept(memory, graph)

    # A place where road is blocked is linked to what counted on it: the agent, or the plan.
    links = []
    for name in sorted(memory.pending):
        if place_cell(name) is not None:
            source = expected_by(name, graph)
            links.append(Link(source=source, target=name, kind=LinkKind.BLOCKED))

    misled = {link.source for link in links}
    surprising: list[AnyNode] = [*nodes_of(graph, Object, sorted(memory.pending))]
    plan = graph.get(Plan, PLAN_ID)
    if plan is not None and PLAN_ID in misled:
        surprising.append(plan)
    if not surprising and SELF_ID not in misled:
        return kept(memory, graph)

    content = [felt(node, SURPRISE) for node in surprising]
    content.insert(0, felt(agent, SURPRISE) if SELF_ID in misled else agent)
    found = coalition(NAME, content, graph, links, feeling=Feeling.SURPRISE)
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
    memory: Attention, task: Task, agent: Self, graph: Graph, config: Config
) -> Attention:
    """Count in `memory` the views in which each object was missing since it was seen last, or the
    agent was far from it. Objects that reach the number that is a surprise become pending.
    """
    in_view = {object_id(percept.label) for percept in task.percepts}
    missing = missing_objects(task, agent, graph, config.established_sightings)
    noted = {}
    for name, number in memory.noted.items():
        node = graph.get(Object, name)
        is_missing = False
        if node is not None and name not in in_view:
            away_m = math.dist((node.x_m, node.y_m), (agent.x_m, agent.y_m))
            is_missing = away_m <= AWAY * FARTHEST_M
        if is_missing or place_cell(name) is not None:
            noted[name] = number

    gone = []
    for name, counts in missing.items():
        before = memory.noted.get(name, 0)
        noted[name] = min(before + counts, config.views)
        if before < config.views == noted[name]:
            gone.append(name)

    pending = {name: cycle for name, cycle in memory.pending.items() if name in noted}
    counted = msgspec.structs.replace(memory, noted=noted, pending=pending)
    return with_pending(counted, gone)


def _with_blocked(memory: Attention, task: Task, agent: Self, graph: Graph) -> Attention:
    """Note in `memory` the places that two views shortly after each other show blocked, with their
    cycle. They become pending, unless a blockage near them is known already.
    """
    if task.scan is None:
        raise MessageError(f"task {task.task_id}: no range scan")

    noted = {}
    for name, number in memory.noted.items():
        is_old = place_cell(name) is not None and task.cycle - number > SAME_CYCLES
        if not is_old:
            noted[name] = number

    since = task.cycle - GLIMPSE_CYCLES
    glimpsed = {name: cycle for name, cycle in memory.glimpsed.items() if cycle >= since}

    new = []
    cell_m = graph.cell_m(agent.map)
    for blocked in blocked_places(task.scan, agent, graph):
        if is_known(blocked, noted, task.cycle - SAME_CYCLES, cell_m):
            continue
        if is_known(blocked, memory.glimpsed, since, cell_m):
            noted[blocked] = task.cycle
            new.append(blocked)
        glimpsed[blocked] = task.cycle

    after = msgspec.structs.replace(memory, noted=noted, glimpsed=glimpsed)
    return with_pending(after, new)
