"""Road that was blocked and may be free again: tried where no other route is left, not for ever."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import Goal, Plan
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.targets import Target, next_goal


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


def doubted(plan: Plan, before: Plan | None, targets: Sequence[Target]) -> list[Operation]:
    """The next goal with one doubt more, where the plan begins to lead over blocked road."""
    goal_before = next_goal(before) if before is not None and before.doubtful else ""
    if not plan.doubtful or next_goal(plan) == goal_before:
        return []

    goals = [target.goal for target in targets if target.goal.id == next_goal(plan)]
    return [msgspec.structs.replace(goal, doubts=goal.doubts + 1) for goal in goals]
