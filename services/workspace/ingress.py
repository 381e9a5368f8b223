"""Builds what enters the workspace at the start of a cycle."""

from __future__ import annotations

import numpy as np

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import CycleContext
from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import Decay, Links, Operation
from cogmap.schemas.nodes import (
    POSE_COLUMNS,
    ROOT_MAP,
    SELF_ID,
    Goal,
    LinkKind,
    Map,
    Percept,
    Self,
    goal_id,
    object_id,
    percept_id,
)
from cogmap.schemas.sensing import Percepts
from cogmap.services.workspace.config import Config

FIRST_SAMPLES = 200
"""Samples of the self before anything is known; localization draws as many as it wants."""

PLACE_DECAY = 0.02
"""What a place node's activation loses in a cycle. LIDA: 0.1 in a tick; here less, because a place
is excited only while the agent is at it: those of the last ten seconds stay active.
"""

FORGET_BELOW = 0.05
"""A node is forgotten when its total activation falls below this; chosen, not tuned."""

KEPT_BASE_LEVEL = 0.9
"""A base level that was learned up to this does not decay below it. With much less, objects are
kept that were seen in a few views from one side: placed badly, they would mislead localization.
"""


def first_operations(graph: Graph, config: Config) -> list[Operation]:
    """Make the root map, the rates of decay and the self node, as far as the graph lacks them.

    The agent's first pose is the origin of its root map, for certain.
    """
    operations: list[Operation] = []
    rates = Decay(
        activation=config.decay,
        base_level=config.base_level_decay,
        place_activation=PLACE_DECAY,
        forget_below=FORGET_BELOW,
        kept_base_level=KEPT_BASE_LEVEL,
    )
    if graph.decay != rates:
        operations.append(rates)

    if graph.get(Map, ROOT_MAP) is None:
        operations.append(Map(id=ROOT_MAP, cell_m=config.cell_m))

    if graph.agent is None:
        zeros = np.zeros((FIRST_SAMPLES, POSE_COLUMNS))
        samples = Matrix.of(zeros)
        operations.append(Self(id=SELF_ID, activation=1.0, base_level=1.0, samples=samples))
    return operations


def first_goals(config: Config, before_ns: int, now_ns: int) -> list[Goal]:
    """Return the goals that the settings give the agent, in their order, if they are due between
    the view of the cycle before and this one.
    """
    due_ns = round(config.goals_after_s * 1e9)
    if not before_ns < due_ns <= now_ns:
        return []

    goals: list[Goal] = []
    for given in config.goals:
        is_next = config.in_order and bool(goals)
        goal = Goal(
            id=goal_id(given.name),
            base_level=1.0,
            object=given.object,
            x_m=given.x_m,
            y_m=given.y_m,
            after=goals[-1].id if is_next else "",
        )
        goals.append(goal)

    return goals


def check_percepts(percepts: Percepts) -> None:
    """Raise MessageError if points of the road or its boundary are not (n, 2)."""
    for name, points_m in (("road", percepts.road_m), ("boundary", percepts.road_boundary_m)):
        if len(points_m.shape) != 2 or points_m.shape[1] != 2:
            raise MessageError(f"{name} points of shape {points_m.shape}")


def percept_operations(graph: Graph, context: CycleContext) -> list[Operation]:
    """Make the PAM nodes over threshold, each linked to the object that it is an instance of."""
    operations: list[Operation] = []
    weights = {}
    for percept in context.percepts.objects:
        node = Percept(
            id=percept_id(percept.label),
            activation=percept.activation,
            cycle=context.cycle,
            salience=percept.salience,
            label=percept.label,
            name=percept.name,
            bearing_rad=percept.bearing_rad,
            range_m=percept.range_m,
        )
        operations.append(node)

        target = object_id(percept.label)
        if target in graph.nodes:
            weights[node.id] = {target: 1.0}

    if weights:
        operations.append(Links(kind=LinkKind.INSTANCE, weights=weights))
    return operations
