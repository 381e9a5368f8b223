"""A motor module that is restarted continues with its motor program."""

from __future__ import annotations

import msgspec

from cogmap.schemas.cognition import ActionName, MotorProgram
from cogmap.testing import agent
from tests.support.world.motor import (
    action_of,
    commands_in,
    driving_module,
    module_ahead,
    module_without_plan,
    pose_delta,
)
from tests.support.world.plans import joined, plan_along


def test_a_restarted_motor_module_continues_along_its_route() -> None:
    before = module_ahead(length_m=40.0)
    plan = plan_along((0.0, 0.0), (40.0, 0.0))
    after = joined(module_without_plan(), plan, agent(x_m=24.0))
    messages = before.feed(action_of())
    for cycle in range(1, 13):
        messages += before.feed(pose_delta(cycle, 2.0 * cycle))

    programs = [message for message in messages if isinstance(message, MotorProgram)]
    assert before.compact is not None
    assert after.restore is not None
    assert before.compact() == msgspec.structs.replace(programs[-1], seq=0, source="")

    after.restore(programs)
    (command,) = commands_in(after.feed(pose_delta(13, 25.0)))

    assert command.left_wheel_rad_s == command.right_wheel_rad_s > 0


def test_a_restarted_motor_module_executes_no_past_action_again() -> None:
    (program,) = driving_module().feed(action_of(5, ActionName.HALT))
    after = module_ahead()
    assert after.restore is not None
    after.restore([program])

    assert after.feed(action_of(4)) == []
    (started,) = after.feed(action_of(6))

    assert isinstance(started, MotorProgram)
    assert started.cycle == 6
