"""An attention codelet: what stands so near ahead that the agent may run into it."""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.graph.graph import Graph
from cogmap.robot import CLEARANCE_M, HALF_WIDTH_M
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

NAME = "danger"
AHEAD = "ahead"
# Salience is from -1, bad, to 1: nothing is more salient.
BAD = -1.0
# Little more than the distance at which the robot is stopped.
NEAREST_M = CLEARANCE_M + 0.4
# After so many cycles without a danger the next one is another, and brought again.
SAME_CYCLES = 25


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """Return one task if something stands near ahead, and until that is conscious."""
    if graph.agent is None or context.scan is None:
        return []
    if is_refractory(NAME, graph, context.cycle):
        return []

    percepts = context.percepts.objects
    task = context.task(NAME, about=[SELF_ID], percepts=percepts, with_scan=True)
    is_due = bool(memory_of(NAME, graph).pending) or is_blocked(task)
    return [task] if is_due else []


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Bring a coalition of the self and the nearest object in view, to know the place again by."""
    agent = graph.agent
    if agent is None:
        return Answer()

    memory = without_conscious(memory_of(NAME, graph))
    if is_blocked(task):
        last = memory.noted.get(AHEAD)
        memory = msgspec.structs.replace(memory, noted={AHEAD: task.cycle})
        if last is None or task.cycle - last > SAME_CYCLES:
            memory = with_pending(memory, [AHEAD])
    if not memory.pending:
        return kept(memory, graph)

    content: list[AnyNode] = [felt(agent, BAD)]
    by_range = sorted(task.percepts, key=lambda each: (each.range_m, each.label))
    names = [object_id(each.label) for each in by_range if each.has_range]
    content += [felt(node, BAD) for node in nodes_of(graph, Object, names)[:1]]

    found = coalition(
        NAME,
        content,
        graph,
        percepts=task.percepts,
        feeling=Feeling.DANGER,
    )
    return brought(memory, found, task.cycle, graph)


CODELET = Codelet(
    name=NAME,
    phase=Phase.ATTENTION,
    due=due,
    run=run,
    reads=frozenset({Self, Object, Attention}),
    writes=frozenset({Attention}),
)


def is_blocked(task: Task) -> bool:
    """Return whether the range scan has something near in the lane ahead, in two of its rays: one
    alone may be noise.
    """
    if task.scan is None:
        return False

    bearing_rad, range_m = np.asarray(task.scan.numpy(), np.float64).T
    ahead_m = range_m * np.cos(bearing_rad)
    is_in_lane = np.abs(range_m * np.sin(bearing_rad)) < HALF_WIDTH_M
    is_near = (range_m > 0) & (ahead_m > 0) & (ahead_m <= NEAREST_M)
    return int((is_in_lane & is_near).sum()) > 1
