"""The experimenter of the explore benchmark: goals offered, streets closed, goals taken back."""

from __future__ import annotations

import numpy as np

from benchmarks.explore.experimenter import Experimenter
from schemas.array import Array, Matrix
from schemas.base import Message
from schemas.codelets import Offer
from schemas.graph import DropNode, Operation
from schemas.nodes import PLAN_ID, ROOT_MAP, Goal, Map, Plan, PlanState
from schemas.sensing import Pose, Street, TruePose, TrueTown

EVERY_S = 1_000_000_000
KERB = np.array([[0.0, -4.0, 100.0, -4.0]], np.float32)


def _one_street() -> TrueTown:
    street = Street(name="alley", line_m=[(0.0, 0.0), (100.0, 0.0)], width_m=6.0)
    return TrueTown(seed=1, streets=[street], buildings=[], kerbs_m=Array.of(KERB))


def _pose(second: int) -> TruePose:
    pose = Pose(x_m=1.0, y_m=0.0, heading_rad=0.0)
    return TruePose(
        stamp_ns=second * EVERY_S,
        pose=pose,
        travelled_m=0.0,
        progress=0.0,
    )


def _offered(messages: list[Message]) -> list[Operation]:
    """The operations of the offers, carried out by nobody."""
    operations: list[Operation] = []
    for message in messages:
        assert isinstance(message, Offer)
        operations += message.operations
    return operations


def _planned(goal: Goal) -> Plan:
    route_m = np.column_stack([np.linspace(0.0, goal.x_m, 40), np.zeros(40)])
    return Plan(id=PLAN_ID, state=PlanState.READY, goals=[goal.id], route=Matrix.of(route_m))


def test_a_goal_is_taken_back_where_no_street_on_its_route_can_be_closed() -> None:
    experimenter = Experimenter(seed=1, explore_s=0.0, goals=3)
    experimenter.graph.change([Map(id=ROOT_MAP, cell_m=1.0)])
    experimenter.on_town(_one_street())

    taken_back = 0
    for second in range(1, 12):
        for operation in _offered(experimenter.on_pose(_pose(second))):
            if isinstance(operation, DropNode):
                assert operation.id in experimenter.graph.nodes
                taken_back += 1
            experimenter.graph.change([operation])
            if isinstance(operation, Goal) and len(experimenter.trials) == 1:
                experimenter.graph.change([_planned(operation)])
        _reach_first(experimenter)

    assert taken_back > 2
    assert len(list(experimenter.graph.of_kind(Goal))) <= 1


def _reach_first(experimenter: Experimenter) -> None:
    """The first goal, of which no street is closed, counts as reached at once."""
    goals = list(experimenter.graph.of_kind(Goal))
    if goals and not experimenter.trials:
        (goal,) = goals
        reached = Goal(id=goal.id, x_m=goal.x_m, y_m=goal.y_m, reached_ns=1)
        experimenter.graph.change([reached])
