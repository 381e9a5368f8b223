"""The experimenter of the explore benchmark: goals offered, streets closed, goals taken back."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from benchmarks.explore.drivable import Drivable
from benchmarks.explore.experimenter import MAX_DRAWS, Experimenter
from benchmarks.explore.trials import closed_as
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import DropNode, Operation
from cogmap.schemas.nodes import PLAN_ID, ROOT_MAP, Goal, Map, Plan, PlanState
from cogmap.schemas.sensing import Pose, Street, StreetClosure, TruePose, TrueTown

EVERY_S = 1_000_000_000
KERB = np.array([[0.0, -4.0, 100.0, -4.0]], np.float32)


def _one_street() -> TrueTown:
    street = Street(name="alley", line_m=[(0.0, 0.0), (100.0, 0.0)], width_m=6.0)
    return TrueTown(seed=1, streets=[street], buildings=[], kerbs_m=Array.of(KERB))


def _block() -> TrueTown:
    """Four streets around one block: with one closed all is still reached, with two not."""
    corners_m = [(0.0, 0.0), (100.0, 0.0), (100.0, 80.0), (0.0, 80.0), (0.0, 0.0)]
    streets = []
    for number, line_m in enumerate(pairwise(corners_m)):
        streets.append(Street(name=f"street-{number}", line_m=list(line_m), width_m=6.0))
    return TrueTown(seed=1, streets=streets, buildings=[], kerbs_m=Array.of(KERB))


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


def test_the_street_closed_longest_is_opened_where_no_other_can_be_closed() -> None:
    town = _block()
    experimenter = Experimenter(seed=1, explore_s=0.0, goals=4)
    experimenter.graph.change([Map(id=ROOT_MAP, cell_m=1.0)])
    experimenter.on_town(town)

    closures: list[StreetClosure] = []
    for second in range(1, 10 * MAX_DRAWS):
        for message in experimenter.on_pose(_pose(second)):
            if isinstance(message, StreetClosure):
                closures.append(message)
                is_first = len(closures) == 1
                town = closed_as(_block(), message.street) if is_first else _block()
                experimenter.on_town(town)
                continue

            for operation in _offered([message]):
                experimenter.graph.change([operation])
                if isinstance(operation, Goal):
                    experimenter.graph.change([_along_streets(operation, town)])

        closes = len(experimenter.trials) % 2 == 1
        if len(closures) == 1 or not closes:
            _reach(experimenter, first_drives=3)
        if len(closures) == 2:
            break

    closed, opened = closures
    assert closed.closed
    assert not opened.closed
    assert opened.street == closed.street


def _along_streets(goal: Goal, town: TrueTown) -> Plan:
    route_m = Drivable.of(town).route_m((1.0, 0.0), (goal.x_m + 1.0, goal.y_m))
    on_map_m = route_m - (1.0, 0.0)
    return Plan(id=PLAN_ID, state=PlanState.READY, goals=[goal.id], route=Matrix.of(on_map_m))


def _reach(experimenter: Experimenter, first_drives: int) -> None:
    """The goal of a drive counts as reached at once, of so many drives."""
    for goal in list(experimenter.graph.of_kind(Goal)):
        if len(experimenter.trials) < first_drives:
            reached = Goal(id=goal.id, x_m=goal.x_m, y_m=goal.y_m, reached_ns=1)
            experimenter.graph.change([reached])
