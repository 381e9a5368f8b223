"""The goals that count now, and where the agent must be for a goal to be reached."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.graph.graph import Graph
from cogmap.schemas.graph import DropNode, Operation
from cogmap.schemas.nodes import (
    NEVER_NS,
    Goal,
    Need,
    Object,
    Plan,
    PlanState,
    Self,
    need_id,
    object_id,
)
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.ground import Ground

Cell = tuple[int, int]


class Target(NamedTuple):
    """A goal, and the cell to drive to; None, with the reason, where there is none."""

    goal: Goal
    cell: Cell | None
    state: PlanState = PlanState.READY


def open_goals(graph: Graph, at: Collection[str] = ()) -> list[Goal]:
    """The goals that were not reached yet, and wait for none that was not, by id; the agent is `at`
    goals of these ids now.
    """
    pending = pending_goals(graph, at)
    return [goal for goal in pending.values() if goal.after not in pending]


def pending_goals(graph: Graph, at: Collection[str] = ()) -> dict[str, Goal]:
    """The goals that were not reached yet, by id."""
    goals = [goal for goal in graph.of_kind(Goal) if goal.id not in at]
    return {goal.id: goal for goal in goals if goal.reached_ns == NEVER_NS}


def goals_m(graph: Graph) -> Floats:
    """(n, 2): where the open goals are, without those that are at objects unknown."""
    positions_m = []
    for goal in open_goals(graph):
        found = graph.get(Object, object_id(goal.object)) if goal.object else goal
        if found is not None:
            positions_m.append((found.x_m, found.y_m))

    return np.array(positions_m, np.float64).reshape(-1, 2)


def next_goal(plan: Plan | None) -> str:
    """The id of a plan's next goal, empty where it has none."""
    if plan is None or not plan.goals:
        return ""
    return plan.goals[0]


def is_at(target: Target, agent: Self, ground: Ground, config: Config) -> bool:
    """Whether the agent is at the place of a goal."""
    if target.cell is None:
        return False

    i, j = target.cell
    cell_m = ground.network.cell_m
    away_m = math.hypot(i * cell_m - agent.x_m, j * cell_m - agent.y_m)
    return away_m <= config.reached_m


def as_reached(goal: Goal, stamp_ns: int) -> Operation:
    """That a goal was reached; one that served a need is forgotten."""
    if goal.need:
        return DropNode(id=goal.id)
    return msgspec.structs.replace(goal, reached_ns=stamp_ns)


def is_satisfied(goal: Goal, graph: Graph, config: Config) -> bool:
    """Whether an agent that is at a goal has what it came for: the need that the goal serves, if
    any, is low.
    """
    need = graph.get(Need, need_id(goal.need)) if goal.need else None
    return need is None or need.level <= config.satisfied_level


def most_pressing(targets: list[Target]) -> list[Target]:
    """The targets that serve a need, where there are any that have a place; otherwise all."""
    pressing = [target for target in targets if target.goal.need and target.cell is not None]
    return pressing or targets


def has_arrived(graph: Graph, at: Collection[str] = ()) -> bool:
    """Whether there are goals, and all are reached."""
    has_goals = any(True for _ in graph.of_kind(Goal))
    return has_goals and not pending_goals(graph, at)


def target_of(goal: Goal, graph: Graph, ground: Ground, config: Config) -> Target:
    """The free place nearest to a goal.

    An object is reached from a known place within `approach_m`; a position that is not free from a
    place within `snap_m`.
    """
    x_m = goal.x_m
    y_m = goal.y_m
    if goal.object:
        found = graph.get(Object, object_id(goal.object))
        if found is None:
            return Target(goal, None, PlanState.UNKNOWN_GOAL)

        cell = nearest_free(found.x_m, found.y_m, ground, ground.is_known, config.approach_m)
        if cell is None:
            return Target(goal, None, PlanState.NO_ROUTE)
        return Target(goal, cell)

    if not _is_inside(x_m, y_m, ground):
        return Target(goal, None, PlanState.OUTSIDE)

    cell = nearest_free(x_m, y_m, ground, ground.is_free, config.snap_m)
    if cell is None:
        return Target(goal, None, PlanState.BLOCKED)
    return Target(goal, cell)


def nearest_free(
    x_m: float, y_m: float, ground: Ground, is_free: Booleans, within_m: float
) -> Cell | None:
    """The cell of `is_free` (w, h) nearest to a position; None where none is within `within_m`."""
    i0, j0 = ground.network.origin
    cell_m = ground.network.cell_m
    reach = math.ceil(within_m / cell_m)
    i = round(x_m / cell_m) - i0
    j = round(y_m / cell_m) - j0

    low_i = max(0, i - reach)
    low_j = max(0, j - reach)
    near = is_free[low_i : max(0, i + reach + 1), low_j : max(0, j + reach + 1)]
    corner = np.array([low_i + i0, low_j + j0])
    cells = corner + np.argwhere(near)
    if not len(cells):
        return None

    away_m = np.hypot(*(cells * cell_m - (x_m, y_m)).T)
    nearest = int(away_m.argmin())
    if away_m[nearest] > within_m:
        return None

    found_i, found_j = cells[nearest].tolist()
    return found_i, found_j


def _is_inside(x_m: float, y_m: float, ground: Ground) -> bool:
    """Whether a position is on the ground's rectangle."""
    cell_m = ground.network.cell_m
    return ground.network.contains((round(x_m / cell_m), round(y_m / cell_m)))
