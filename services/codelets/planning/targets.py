"""The goals that count now, and where the agent must be for a goal to be reached."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import called
from cogmap.schemas.graph import DropNode, Operation
from cogmap.schemas.nodes import (
    NEVER_NS,
    SATISFIED_BY,
    Goal,
    Need,
    Object,
    Plan,
    PlanState,
    Self,
    need_id,
)
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.network import Cell
from cogmap.services.codelets.planning.place_cost import PlaceCosts

SNAP_M = 3.0
"""Within so far a blocked position is replaced by the nearest free place: half a street's width."""


class Target(NamedTuple):
    """A goal, and the cells to drive to, any of which will do; none, with the reason, if there is
    none.
    """

    goal: Goal
    cells: list[Cell]
    state: PlanState = PlanState.READY


def open_goals(graph: Graph, at: Collection[str] = ()) -> list[Goal]:
    """Return the goals that were not reached yet, and wait for none that was not, by id; the agent
    is `at` goals of these ids now.
    """
    pending = pending_goals(graph, at)
    return [goal for goal in pending.values() if goal.after not in pending]


def pending_goals(graph: Graph, at: Collection[str] = ()) -> dict[str, Goal]:
    """Return the goals that were not reached yet, by id."""
    goals = [goal for goal in graph.of_kind(Goal) if goal.id not in at]
    return {goal.id: goal for goal in goals if goal.reached_ns == NEVER_NS}


def goals_m(graph: Graph, agent: Self) -> Floats:
    """Return the (n, 2) positions of the open goals, without those at objects that are unknown."""
    positions_m = []
    for goal in open_goals(graph):
        found = _objects_of(goal, graph, agent) if goal.object else [goal]
        positions_m.extend([(place.x_m, place.y_m) for place in found])

    return np.array(positions_m, np.float64).reshape(-1, 2)


def next_goal(plan: Plan | None) -> str:
    """Return the id of a plan's next goal, empty if it has none."""
    if plan is None or not plan.goals:
        return ""
    return plan.goals[0]


def is_at(target: Target, agent: Self, costs: PlaceCosts, config: Config) -> bool:
    """Decide whether the agent is at the place of a goal."""
    positions_m = np.array(target.cells, np.float64).reshape(-1, 2) * costs.grid.cell_m
    away_m = np.hypot(*(positions_m - (agent.x_m, agent.y_m)).T)
    return bool((away_m <= config.reached_m).any())


def as_reached(goal: Goal, stamp_ns: int) -> Operation:
    """Mark a goal as reached; forget one that served a need."""
    if goal.need:
        return DropNode(id=goal.id)
    return msgspec.structs.replace(goal, reached_ns=stamp_ns)


def is_satisfied(goal: Goal, graph: Graph, config: Config) -> bool:
    """Decide whether an agent at a goal has what it came for: the need that the goal serves, if
    any, is low.
    """
    need = graph.get(Need, need_id(goal.need)) if goal.need else None
    return need is None or need.level <= config.satisfied_level


def most_pressing(targets: list[Target]) -> list[Target]:
    """Return the targets that serve a need, if any of these has a place; otherwise all."""
    pressing = [target for target in targets if target.goal.need and target.cells]
    return pressing or targets


def has_arrived(graph: Graph, at: Collection[str] = ()) -> bool:
    """Decide whether there are goals, and all are reached."""
    has_goals = any(True for _ in graph.of_kind(Goal))
    return has_goals and not pending_goals(graph, at)


def target_of(goal: Goal, graph: Graph, agent: Self, costs: PlaceCosts, config: Config) -> Target:
    """Find the free places nearest to a goal.

    An object is reached from a known place within `approach_m`, beside which nothing stands if
    there is one, and a goal that serves a need at any object of the agent's map that satisfies it.
    A position that is not free is reached from a place within SNAP_M.
    """
    if goal.object:
        found = _objects_of(goal, graph, agent)
        if not found:
            return Target(goal, [], PlanState.UNKNOWN_GOAL)

        cells = []
        for node in found:
            # The robot stops before what stands ahead of it: it stands clear of that if it can.
            within_m = config.approach_m
            cell = nearest_free(node.x_m, node.y_m, costs, costs.cost() == 1, within_m)
            if cell is None:
                cell = nearest_free(node.x_m, node.y_m, costs, costs.is_known_free, within_m)
            if cell is not None:
                cells.append(cell)
        return Target(goal, cells, PlanState.READY if cells else PlanState.NO_ROUTE)

    if not costs.grid.has(np.array([[goal.x_m, goal.y_m]])).any():
        return Target(goal, [], PlanState.OUTSIDE)

    cell = nearest_free(goal.x_m, goal.y_m, costs, costs.is_free, SNAP_M)
    if cell is None:
        return Target(goal, [], PlanState.BLOCKED)
    return Target(goal, [cell])


def _objects_of(goal: Goal, graph: Graph, agent: Self) -> list[Object]:
    """Return the objects at which a goal is reached."""
    named = called(goal.object, graph)
    function = SATISFIED_BY.get(goal.need)
    if not named or function is None:
        return named

    satisfying = [node for node in graph.of_kind(Object) if node.function == function]
    return [node for node in satisfying if node.map == agent.map] or named


def nearest_free(
    x_m: float, y_m: float, costs: PlaceCosts, is_free: Booleans, within_m: float
) -> Cell | None:
    """Return the cell of `is_free` (w, h) nearest to a position, None if none is within reach."""
    i0, j0 = costs.grid.origin
    cell_m = costs.grid.cell_m
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
