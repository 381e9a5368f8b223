"""A codelet in a package of its own: how far the agent has come, by its self-motion."""

from __future__ import annotations

from typing import Annotated

import msgspec
import numpy as np

from cogmap import Answer, Codelet, CycleContext, Graph, MessageError
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import Node

TRIP = "trip"
SPEED = 0
DT = 2

MinSpeed = Annotated[
    float,
    msgspec.Meta(ge=0, le=10, description="Speed below which the agent stands, in m/s, 0 to 10."),
]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The settings of the codelet, in the section [trip]."""

    min_speed_m_s: MinSpeed = 0.0


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task in each cycle, with the self-motion since the cycle before."""
    return [context.task(CODELET.name, about=[TRIP], with_motions=True)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Return the node `trip` with the distance so far. Raises MessageError without self-motion."""
    if task.motions is None:
        raise MessageError(f"task {task.task_id} has no self-motion")

    motions = np.asarray(task.motions.numpy(), np.float64)
    speeds_m_s = np.abs(motions[:, SPEED])
    moving = speeds_m_s > config.min_speed_m_s
    moved_m = float((speeds_m_s * motions[:, DT])[moving].sum())

    before = graph.get(Node, TRIP)
    before_m = 0.0 if before is None else float(before.attributes["distance_m"])
    trip = Node(
        id=TRIP,
        kind=TRIP,
        activation=1.0,
        base_level=1.0,
        cycle=task.cycle,
        attributes={"distance_m": before_m + moved_m},
    )
    return Answer(operations=[trip])


CODELET = Codelet(
    name=TRIP,
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Node}),
    writes=frozenset({Node}),
    config=Config,
    section=TRIP,
)
