"""Road that was blocked and may be free again: tried where no other route is left, or where others
are far longer; not for ever.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np

from schemas.graph import Operation
from schemas.nodes import Goal, Plan
from services.codelets.planning.config import Config
from services.codelets.planning.ground import Ground
from services.codelets.planning.network import Cell
from services.codelets.planning.routes import Route, Visit, route_to, visits
from services.codelets.planning.targets import Target, next_goal

# No route is a detour that is so many times as long as the distance.
DETOUR = 1.5


def may_doubt(goal: Goal, before: Plan | None, stamp_ns: int, config: Config) -> bool:
    """Whether blocked road may be tried for a goal: a few times, until the plan `before` that does
    so comes to its end, and again where that has stated for a while that there is no route.
    """
    if goal.doubts < config.max_doubts:
        return True
    if before is None:
        return False
    if before.doubtful and next_goal(before) == goal.id:
        return True
    if goal.id not in before.unreachable:
        return False

    since_s = (stamp_ns - before.planned_ns) * 1e-9
    return since_s > config.doubt_after_s


def or_reopened(visit: Visit, start: Cell, where: Ground, config: Config) -> Visit:
    """The visit, or that over road which was blocked and may be free again, where the way is
    shorter by that on average: where it is blocked still the agent has to come back.
    """
    i, j = np.subtract(start, where.network.origin).tolist()
    known_m = float(visit.field.distance_m[i, j])
    away_m = math.dist(start, visit.cell) * where.network.cell_m
    if known_m <= DETOUR * away_m:
        return visit

    (again,) = visits(where.reopened, [visit.target])
    route = route_to(start, again)
    if route is None:
        return visit

    blocked_m = _blocked_after_m(route, where)
    odds_against = (1 - config.reopened_share) / config.reopened_share
    expected_m = route.length_m + odds_against * 2 * blocked_m
    return again if expected_m < known_m else visit


def _blocked_after_m(route: Route, where: Ground) -> float:
    """How far a route leads up to where road is blocked; infinite where it is nowhere."""
    i, j = (route.cells - np.array(where.network.origin)).T
    is_blocked = ~where.is_free[i, j]
    if not is_blocked.any():
        return math.inf

    before = route.cells[: int(is_blocked.argmax()) + 1]
    steps = np.hypot(*np.diff(before, axis=0).T)
    return float(steps.sum()) * where.network.cell_m


def doubted(plan: Plan, before: Plan | None, targets: Sequence[Target]) -> list[Operation]:
    """The next goal with one doubt more, where the plan begins to lead over blocked road."""
    goal_before = next_goal(before) if before is not None and before.doubtful else ""
    if not plan.doubtful or next_goal(plan) == goal_before:
        return []

    goals = [target.goal for target in targets if target.goal.id == next_goal(plan)]
    return [msgspec.structs.replace(goal, doubts=goal.doubts + 1) for goal in goals]
