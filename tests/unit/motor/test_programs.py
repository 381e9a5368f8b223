"""Motor programs: where each action aims."""

from __future__ import annotations

import math

import pytest

from cogmap.errors import MessageError
from cogmap.robot import WHEEL_RADIUS_M
from cogmap.runtime.module import Module
from cogmap.schemas.base import Scalar
from cogmap.schemas.cognition import PARAMETERS, ActionName, MotorProgram
from cogmap.schemas.nodes import PLAN_ID, Plan, PlanState
from cogmap.schemas.sensing import Pose, SpeedLimit
from cogmap.services.motor.aim import Aim
from cogmap.services.motor.config import Config
from cogmap.services.motor.guide import Track
from cogmap.services.motor.programs import (
    DOCK_M_S,
    DOCKED_M,
    FollowPlan,
    Program,
    program_of,
    sought_by,
)
from tests.support.world.motor import action_of, command_after, module_ahead, pose_delta, scan_of
from tests.support.world.plans import plan_along


def _program(action: str, **parameters: float) -> Program:
    config = Config()
    follow = FollowPlan(config)
    follow.take(plan_along((0.0, 0.0), (50.0, 0.0)), None)
    return program_of(action, parameters, follow, config, Track())


def _at(x_m: float = 0.0, y_m: float = 0.0, heading_rad: float = 0.0) -> Pose:
    return Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)


def _executing(action: str, **parameters: float) -> Module:
    module = module_ahead()
    module.feed(action_of(1, action, **parameters))
    return module


def test_a_turn_is_made_on_the_spot_until_it_is_complete() -> None:
    turn = _program(ActionName.TURN, turn_rad=-2.0)
    aims = [turn.aim(_at(heading_rad=3.0 - turned_rad)) for turned_rad in (0.0, 0.5, 1.98)]

    first, second, third = aims
    assert isinstance(first, Aim)
    assert isinstance(second, Aim)
    assert first.on_the_spot
    assert (first.bearing_rad, second.bearing_rad) == pytest.approx((-2.0, -1.5))
    assert third is SpeedLimit.NO_ACTION


def test_a_turn_of_more_than_half_a_circle_goes_all_the_way_round() -> None:
    turn = _program(ActionName.TURN, turn_rad=math.tau)
    headings_rad = [0.1 * step for step in range(100)]
    aims = [turn.aim(_at(heading_rad=heading_rad)) for heading_rad in headings_rad]

    turning = [aim.bearing_rad for aim in aims if isinstance(aim, Aim)]
    assert turning[0] == math.pi
    assert min(turning) > 0.0
    assert len(turning) == pytest.approx(math.tau / 0.1, abs=1)


def test_a_robot_that_turns_moves_its_wheels_against_each_other_also_before_an_obstacle() -> None:
    module = _executing(ActionName.TURN, turn_rad=2.0)
    module.feed(scan_of((0.0, 1.2), (0.05, 1.2)))
    command = command_after(module, pose_delta(1))

    assert command.left_wheel_rad_s == -command.right_wheel_rad_s < 0.0


def test_a_robot_docks_slowly_and_stays_where_it_has_docked() -> None:
    dock = _program(ActionName.DOCK, x_m=10.0, y_m=0.0)
    first = dock.aim(_at())
    last = [dock.aim(_at(x_m)) for x_m in (10.0 - DOCKED_M / 2, 11.0)]

    assert isinstance(first, Aim)
    assert first.speed.m_s == DOCK_M_S
    assert (first.bearing_rad, first.distance_m) == (0.0, 10.0)
    assert last == [SpeedLimit.NO_ACTION, SpeedLimit.NO_ACTION]


def test_an_obstacle_stops_a_robot_that_docks() -> None:
    module = _executing(ActionName.DOCK, x_m=10.0, y_m=0.0)
    free = command_after(module, pose_delta(1))
    module.feed(scan_of((0.0, 1.2), (0.05, 1.2)))
    blocked = command_after(module, pose_delta(2))

    assert free.left_wheel_rad_s == pytest.approx(DOCK_M_S / WHEEL_RADIUS_M)
    assert blocked.halted_by is SpeedLimit.OBSTACLE


def test_other_parameters_start_a_program_anew() -> None:
    module = _executing(ActionName.DOCK, x_m=10.0, y_m=0.0)

    assert module.feed(action_of(2, ActionName.DOCK, x_m=10.0, y_m=0.0)) == []
    (program,) = module.feed(action_of(3, ActionName.DOCK, x_m=10.0, y_m=5.0))
    assert program.parameters == {"x_m": 10.0, "y_m": 5.0}


@pytest.mark.parametrize("parameters", [{}, {"turn_rad": True}, {"turn_rad": "left"}])
def test_a_turn_by_no_number_is_refused(parameters: dict[str, bool | str]) -> None:
    with pytest.raises(MessageError, match=r"parameter 'turn_rad' is .*, not a number"):
        program_of(ActionName.TURN, parameters, FollowPlan(Config()), Config(), Track())


@pytest.mark.parametrize("action", ActionName)
def test_a_program_needs_all_the_parameters_that_schemes_are_checked_for(action: str) -> None:
    given: dict[str, Scalar] = {name: kind(1) for name, kind in PARAMETERS[action].items()}
    _begin(action, given)

    for name in given:
        others = {each: value for each, value in given.items() if each != name}
        with pytest.raises(MessageError, match=f"parameter {name!r} is None"):
            _begin(action, others)


def _begin(action: str, parameters: dict[str, Scalar]) -> None:
    """Begin a motor program, and seek what it seeks. Raises MessageError."""
    program_of(action, parameters, FollowPlan(Config()), Config(), Track())
    sought_by(MotorProgram(cycle=1, action=action, parameters=parameters))


def test_a_halt_at_the_goal_states_that_it_is_there() -> None:
    follow = FollowPlan(Config())
    halt = program_of(ActionName.HALT, {}, follow, Config(), Track())
    before = halt.aim(_at())
    follow.take(Plan(id=PLAN_ID, state=PlanState.AT_GOAL, planned_ns=1), None)

    assert (before, halt.aim(_at())) == (SpeedLimit.NO_ROUTE, SpeedLimit.AT_GOAL)
