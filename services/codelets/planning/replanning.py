"""Occasions to plan: is there anything to plan for, and must it be planned at once?"""

from __future__ import annotations

import numpy as np

from cogmap.graph.graph import Graph
from cogmap.graph.window import Extent
from cogmap.schemas.nodes import PLAN_ID, PlaceColumn, Plan, PlanState, Self
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.place_cost import is_obstructed
from cogmap.services.codelets.planning.targets import has_arrived, open_goals

BLOCKED_M = 30.0
"""Farther than obstacles are put on the map."""


def is_done(graph: Graph, config: Config) -> bool:
    """Decide whether there is nothing to plan for, and no plan that states otherwise."""
    plan = graph.get(Plan, PLAN_ID)
    has_ended = plan is None or plan.state in {PlanState.NO_GOAL, PlanState.AT_GOAL}
    explores = config.explore and not has_arrived(graph)
    return has_ended and not explores and not open_goals(graph)


def is_urgent(graph: Graph, agent: Self, config: Config) -> bool:
    """Decide whether to plan at once: there is no plan, or a goal is not in it, or the agent is at
    the end of its route, or something stands on that.
    """
    plan = graph.get(Plan, PLAN_ID)
    if plan is None:
        return True

    planned = {*plan.goals, *plan.unreachable}
    if any(goal.id not in planned for goal in open_goals(graph)):
        return True
    if plan.route is None:
        return False

    away_m = np.hypot(*(plan.route.numpy() - (agent.x_m, agent.y_m)).T)
    is_at_end = bool(away_m[-1] <= config.reached_m)
    return is_at_end or _is_blocked(plan, int(away_m.argmin()), graph)


def _is_blocked(plan: Plan, nearest: int, graph: Graph) -> bool:
    """Decide whether something stands within BLOCKED_M ahead on a plan's route, at whose place
    number `nearest` the agent is; not if the plan is to find out whether it does.
    """
    if plan.route is None or plan.doubtful:
        return False

    cell_m = graph.cell_m(plan.map)
    last = nearest + round(BLOCKED_M / cell_m)
    ahead = np.rint(plan.route.numpy()[nearest:last] / cell_m).astype(np.int64)
    first_i, first_j = (ahead.min(axis=0) - 1).tolist()
    last_i, last_j = (ahead.max(axis=0) + 2).tolist()

    around = Extent((first_i, first_j), (last_i, last_j))
    window = graph.places.window(plan.map, [PlaceColumn.OBSTACLE], around)
    is_obstacle = is_obstructed(window.column(PlaceColumn.OBSTACLE))
    return bool(is_obstacle[tuple((ahead - around.lower).T)].any())
