"""How far a drive to goals is, and why a goal was not reached, by goals and plans. Pure."""

from __future__ import annotations

from cogmap.graph.graph import Graph
from cogmap.hints import nearest
from cogmap.schemas.graph import Delta, DropNode
from cogmap.schemas.nodes import NEVER_NS, PLAN_ID, Goal, Object, Plan, PlanState, goal_id

MIN_AHEAD_M = 1.0
"""The least distance to a goal that is not reached: a share of 1 means that all are."""


class GoalProgress:
    """Follows the goals, and the way to the next of them."""

    def __init__(self) -> None:
        self._is_reached: dict[str, bool] = {}
        self._plan: Plan | None = None
        self._since_m = 0.0
        self._planned_at_m = 0.0

    def update(self, delta: Delta, travelled_m: float) -> None:
        """Take account of a delta, the robot having travelled so far."""
        before = dict(self._is_reached)
        for operation in delta.operations:
            match operation:
                case Goal():
                    self._is_reached[operation.id] = operation.reached_ns != NEVER_NS
                case Plan():
                    self._plan = operation
                    self._planned_at_m = travelled_m
                case DropNode():
                    self._is_reached.pop(operation.id, None)

        if self._is_reached != before:
            self._since_m = travelled_m

    @property
    def count(self) -> int:
        """Return how many goals the agent has."""
        return len(self._is_reached)

    @property
    def reached(self) -> int:
        """Return how many of its goals the agent has reached."""
        return sum(self._is_reached.values())

    def share(self, travelled_m: float) -> float:
        """Compute the share of its goals that the agent has reached, the next one by the part of
        the planned way that is behind it; below 1 while one is left to reach, 0 if it has none.
        """
        if not self.count:
            return 0.0

        plan = self._plan
        if plan is None or plan.route is None or plan.explores or self.reached == self.count:
            return self.reached / self.count

        behind_m = travelled_m - self._since_m
        since_plan_m = travelled_m - self._planned_at_m
        ahead_m = max(MIN_AHEAD_M, plan.length_m - since_plan_m)
        return (self.reached + behind_m / (behind_m + ahead_m)) / self.count


def name_of(goal: str) -> str:
    """Return the name of the goal with this id."""
    return goal.removeprefix(goal_id(""))


def unreached(graph: Graph) -> dict[str, str]:
    """Explain why each goal of the agent was not reached, by its name: why it has no route, or what
    was still to be done.
    """
    plan = graph.get(Plan, PLAN_ID)
    reasons = {}
    for goal in graph.of_kind(Goal):
        if goal.reached_ns == NEVER_NS:
            reasons[name_of(goal.id)] = _reason(goal, plan, graph)

    return reasons


def routeless(goal: str, state: PlanState, graph: Graph) -> str:
    """Say why a goal has no route, and what may have been meant by one that is not on the map."""
    meant = nearest_label(goal, state, graph)
    return f"{state.value}: did you mean {meant!r}?" if meant else state.value


def nearest_label(goal: str, state: PlanState, graph: Graph) -> str:
    """Find the label on the map that is most like that of the goal with this id, which is not on
    it; empty if none is like it, or if the goal has no route for another reason.
    """
    if state is not PlanState.UNKNOWN_GOAL:
        return ""
    node = graph.get(Goal, goal)
    label = node.object if node is not None else name_of(goal)
    known = [each.name or each.label for each in graph.of_kind(Object)]
    return nearest(label, sorted(set(known)))


def _reason(goal: Goal, plan: Plan | None, graph: Graph) -> str:
    if plan is not None and goal.id in plan.unreachable:
        return routeless(goal.id, plan.unreachable[goal.id], graph)

    before = graph.get(Goal, goal.after) if goal.after else None
    if before is not None and before.reached_ns == NEVER_NS:
        return f"it comes after {name_of(before.id)}"
    if plan is not None and goal.id in plan.goals:
        return "a route leads there, which was not driven to its end"
    return "nothing was planned for it"
