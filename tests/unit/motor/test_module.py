"""Sensory-motor memory as a module: what actions, poses, scans and clocks make of the wheels."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.runtime.run import LOCKSTEP, REAL_TIME, Run
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.cognition import ActionName, MotorProgram
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import PLAN_ID, Plan, PlanState
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import SpeedLimit
from cogmap.services.motor.module import Config
from tests.support.world.motor import (
    PERIOD_NS,
    action_of,
    command_after,
    commands_in,
    competition_of,
    driving_module,
    module_ahead,
    module_without_plan,
    motion_of,
    no_action_of,
    plan_delta,
    pose_delta,
    scan_of,
)
from tests.support.world.plans import joined


def test_before_any_action_the_robot_stands() -> None:
    command = command_after(module_ahead(), pose_delta())

    assert command.left_wheel_rad_s == 0.0
    assert command.halted_by is SpeedLimit.NO_ACTION


def test_an_action_starts_its_program_and_the_next_pose_moves_the_robot() -> None:
    module = module_ahead()
    (program,) = module.feed(action_of())

    assert isinstance(program, MotorProgram)
    assert (program.action, program.cycle) == (ActionName.FOLLOW_PLAN, 1)

    (command,) = commands_in(module.feed(pose_delta()))

    assert command.left_wheel_rad_s > 0
    assert command.stamp_ns == PERIOD_NS


def test_a_program_that_is_executed_is_not_started_again() -> None:
    module = driving_module()

    assert module.feed(action_of(2)) == []
    assert module.feed(no_action_of(3)) == []
    assert command_after(module, pose_delta()).left_wheel_rad_s > 0


def test_an_action_without_a_motor_program_is_refused_by_name() -> None:
    with pytest.raises(MessageError, match="no motor program for 'fly': there are follow_plan"):
        module_ahead().feed(action_of(1, "fly"))


def test_at_the_end_of_the_route_the_robot_stands() -> None:
    module = module_ahead(length_m=3.0)
    module.feed(action_of())
    for cycle in range(1, 20):
        module.feed(pose_delta(cycle, 0.5 * cycle))

    (command,) = commands_in(module.feed(pose_delta(20, 9.0)))

    assert (command.left_wheel_rad_s, command.right_wheel_rad_s, command.halted_by) == (
        0.0,
        0.0,
        "end of route",
    )


def test_a_halt_is_for_want_of_an_action_where_there_is_a_route() -> None:
    module = driving_module()
    module.feed(action_of(2, ActionName.HALT))

    assert command_after(module, pose_delta(3)).halted_by is SpeedLimit.NO_ACTION


def test_without_a_plan_the_robot_is_halted_for_want_of_a_route() -> None:
    module = module_without_plan()
    module.feed(action_of())
    command = command_after(module, pose_delta())

    assert command.halted_by is SpeedLimit.NO_ROUTE


@pytest.mark.parametrize(
    ("state", "halted_by"),
    [
        (PlanState.AT_GOAL, SpeedLimit.AT_GOAL),
        (PlanState.NO_GOAL, SpeedLimit.NO_ROUTE),
        (PlanState.NO_ROUTE, SpeedLimit.NO_ROUTE),
    ],
)
def test_a_plan_without_a_route_halts_the_robot(state: PlanState, halted_by: SpeedLimit) -> None:
    module = joined(module_without_plan(), Plan(id=PLAN_ID, state=state, planned_ns=1))
    module.feed(action_of())

    assert command_after(module, pose_delta()).halted_by is halted_by


def test_where_the_plan_ends_at_the_agents_own_place_there_is_no_route() -> None:
    here = Matrix.of(np.zeros((1, 2)))
    plan = Plan(id=PLAN_ID, state=PlanState.READY, planned_ns=1, route=here)
    module = joined(module_without_plan(), plan)
    module.feed(action_of())

    assert command_after(module, pose_delta()).halted_by is SpeedLimit.NO_ROUTE


@pytest.mark.parametrize("run", [LOCKSTEP, REAL_TIME])
def test_a_plan_is_driven_from_the_next_pose_on(run: Run) -> None:
    module = module_ahead(run)
    for message in (action_of(0), motion_of(), scan_of()):
        module.feed(message)
    ahead = command_after(module, pose_delta(1))

    assert module.feed(plan_delta(2, (0.0, 0.0), (0.0, 20.0))) == []
    for message in (motion_of(3), scan_of(cycle=3), competition_of(2)):
        module.feed(message)
    aside = command_after(module, pose_delta(3))

    assert ahead.left_wheel_rad_s == ahead.right_wheel_rad_s
    assert aside.left_wheel_rad_s < aside.right_wheel_rad_s


def test_an_obstacle_in_the_scan_halts_the_robot_until_it_has_gone() -> None:
    module = driving_module()
    module.feed(scan_of((0.0, 1.2), (0.05, 1.2)))
    before_it = command_after(module, pose_delta(1))

    module.feed(scan_of(cycle=2))
    afterwards = command_after(module, pose_delta(2))

    assert before_it.halted_by is SpeedLimit.OBSTACLE
    assert afterwards.halted_by is SpeedLimit.NONE


@pytest.mark.parametrize("phase", [Phase.PERCEPTS, Phase.OBJECTS, Phase.END])
def test_deltas_without_a_new_pose_lead_to_no_command(phase: str) -> None:
    delta = pose_delta(phase=phase)

    assert module_ahead().feed(delta) == []


def test_a_pose_that_is_committed_late_leads_to_a_command_too() -> None:
    late = pose_delta(phase=Phase.LATE)
    published = module_ahead().feed(late)

    assert len(commands_in(published)) == 1


def test_each_pose_leads_to_one_command() -> None:
    module = module_ahead(LOCKSTEP)
    answers = [
        module.feed(message)
        for message in (
            motion_of(),
            scan_of(),
            pose_delta(1),
            motion_of(),
            competition_of(1),
            competition_of(1),
        )
    ]

    assert [len(commands_in(answer)) for answer in answers] == [0, 0, 1, 0, 0, 0]


def test_in_lockstep_a_repeated_scan_has_the_command_for_its_view_repeated() -> None:
    module = module_ahead(LOCKSTEP)
    for message in (motion_of(), scan_of()):
        module.feed(message)
    (command,) = commands_in(module.feed(pose_delta(1)))

    (again,) = commands_in(module.feed(scan_of()))
    assert msgspec.structs.replace(again, seq=command.seq) == command


def _clock(at_s: float) -> Clock:
    return Clock(stamp_ns=round(at_s * 1e9), rate=1.0)


def test_a_pose_that_is_old_by_the_clock_moves_the_robot_more_slowly() -> None:
    fresh = driving_module()
    slow = driving_module()
    slow.feed(_clock(0.2 + 1.0))
    fast_command = command_after(fresh, pose_delta(1))
    slow_command = command_after(slow, pose_delta(1))

    assert 0 < slow_command.left_wheel_rad_s < fast_command.left_wheel_rad_s
    assert slow_command.slowed_by is SpeedLimit.POSE_AGE
    assert slow_command.pose_age_ns == 10**9


def test_a_moving_robot_that_gets_no_new_pose_is_halted_once() -> None:
    module = driving_module()
    module.feed(pose_delta(1))
    assert module.feed(_clock(0.2 + 1.0)) == []

    halt = command_after(module, _clock(0.2 + 2.1))
    assert halt.halted_by is SpeedLimit.POSE_AGE
    assert module.feed(_clock(0.2 + 2.2)) == []


def test_a_robot_that_is_commanded_to_move_and_stands_is_stuck_and_backs_away() -> None:
    module = driving_module()
    backs = {}
    for cycle in range(1, 40):
        module.feed(motion_of(cycle, speed_m_s=0.02))
        command = command_after(module, pose_delta(cycle))
        if command.left_wheel_rad_s < 0.0:
            backs[cycle] = command.slowed_by

    stuck_cycles = Config().stuck_after_s * 1e9 / PERIOD_NS
    assert set(backs.values()) <= {SpeedLimit.STUCK, SpeedLimit.OBSTACLE}
    assert backs[min(backs)] is SpeedLimit.STUCK
    assert min(backs) == pytest.approx(stuck_cycles + 1, abs=1)


def test_a_robot_that_moves_or_is_not_commanded_to_is_not_stuck() -> None:
    moving = driving_module()
    idle = module_ahead()
    for cycle in range(1, 40):
        moving.feed(motion_of(cycle))
        idle.feed(motion_of(cycle, speed_m_s=0.0))
        drive = command_after(moving, pose_delta(cycle))
        halt = command_after(idle, pose_delta(cycle))

        assert drive.halted_by is SpeedLimit.NONE
        assert halt.halted_by is SpeedLimit.NO_ACTION


def test_a_self_motion_of_another_shape_is_refused_by_name() -> None:
    three_columns = Array.of(np.zeros((2, 3)))
    motion = msgspec.structs.replace(motion_of(), motions=three_columns)

    with pytest.raises(MessageError, match="rows of 5 columns"):
        module_ahead().feed(motion)


def test_in_a_recording_programs_start_and_every_command_says_that_it_moves_nothing() -> None:
    module = module_ahead(Run(participants={"player": 1}))
    (program,) = module.feed(action_of())

    command = command_after(module, pose_delta())

    assert isinstance(program, MotorProgram)
    assert program.action == ActionName.FOLLOW_PLAN
    assert (command.left_wheel_rad_s, command.right_wheel_rad_s) == (0.0, 0.0)
    assert command.halted_by is SpeedLimit.RECORDING
