"""The object-place codelet: what is recognised for the first time gets a node, samples of its
position, and a place (paper §5.2).
"""

from __future__ import annotations

import msgspec

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import SELF_ID, LinkKind, Object, Self, object_id
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.localization.landmarks import (
    first_positions,
    nearby_selves,
    refreshed,
    with_positions,
)
from cogmap.services.codelets.localization.motion_model import with_gains
from cogmap.services.codelets.localization.sampling import generator, resample


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task for each object in view that the map lacks."""
    by_label = sorted(context.percepts.objects, key=lambda percept: percept.label)

    return [
        context.task(CODELET.name, about=[SELF_ID], subject=percept.label, percepts=[percept])
        for percept in by_label
        if object_id(percept.label) not in graph.nodes
    ]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Make a node for the one percept of `task`, with samples of its position; none while the agent
    is lost.
    """
    agent = graph.agent
    if agent is None:
        raise MessageError(f"task {task.task_id}: the graph has no self node")
    if agent.misfits.is_lost:
        return Answer()

    (percept,) = task.percepts
    rng = generator(task.task_id)
    selves = nearby_selves(with_gains(agent.samples.numpy(), config, rng))
    selves = resample(selves, config.landmark_samples, 0.0, rng)

    node = Object(
        id=object_id(percept.label),
        cycle=task.cycle,
        label=percept.label,
        map=agent.map,
        x_m=agent.x_m,
        y_m=agent.y_m,
        created_ns=task.stamp_ns,
    )
    first = msgspec.structs.replace(node, sightings=1)
    placed = with_positions(first, first_positions(selves, percept, rng))
    return Answer(refreshed(node, placed, percept, task, graph))


CODELET = Codelet(
    name="object_place",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self}),
    writes=frozenset({Object, LinkKind.AT}),
    config=Config,
    section=SECTION,
)
