"""The motor program of guidance drives a path as it was seen a moment ago."""

from __future__ import annotations

import pytest

from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from cogmap.schemas.base import Scalar
from cogmap.schemas.cognition import ActionName, MotorProgram
from cogmap.schemas.sensing import Pose, SpeedLimit
from cogmap.services.motor.aim import Aim
from cogmap.services.motor.config import Config
from cogmap.services.motor.guide import Guide, Track
from tests.support.world.motor import (
    PERIOD_NS,
    action_of,
    command_after,
    module_without_plan,
    pose_delta,
)
from tests.support.world.plans import Point

STRAIGHT: tuple[Point, ...] = ((0.0, 0.0), (10.0, 0.0), (20.0, 0.0))
SEEN_NS = 5


def _parameters(*places_m: Point, seen_ns: int = SEEN_NS) -> dict[str, Scalar]:
    parameters: dict[str, Scalar] = {"seen_ns": seen_ns}
    for number, (ahead_m, left_m) in enumerate(places_m, start=1):
        parameters |= {f"ahead_{number}_m": ahead_m, f"left_{number}_m": left_m}
    return parameters


def _guide(*places_m: Point, track: Track | None = None, share: float = 0.5) -> Guide:
    config = Config(guided_share=share)
    return Guide(_parameters(*places_m), config, track or Track())


def _at(x_m: float = 0.0, y_m: float = 0.0, heading_rad: float = 0.0) -> Pose:
    return Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)


def _bearing_rad(aim: Aim | SpeedLimit) -> float:
    assert isinstance(aim, Aim)
    return aim.bearing_rad


def test_a_path_is_driven_to_its_end() -> None:
    guide = _guide(*STRAIGHT)

    assert _bearing_rad(guide.aim(_at())) == pytest.approx(0.0)
    assert _bearing_rad(guide.aim(_at(5.0, 1.0))) < 0.0
    for x_m in (10.0, 15.0):
        assert isinstance(guide.aim(_at(x_m)), Aim)
    assert guide.aim(_at(19.8)) is SpeedLimit.NO_ACTION


def test_a_path_is_where_it_was_as_seen_from_where_the_agent_was() -> None:
    track = Track()
    track.put(SEEN_NS, _at(0.0, 2.0))
    guide = _guide(*STRAIGHT, track=track)

    assert _bearing_rad(guide.aim(_at(3.0, 2.0))) == pytest.approx(0.0)
    assert _bearing_rad(guide.aim(_at(3.0, 0.0))) > 0.0


def test_at_the_end_of_a_route_the_robot_stands() -> None:
    assert _guide((0.0, 0.0), (0.5, 0.5)).aim(_at()) is SpeedLimit.NO_ACTION


def test_a_new_path_corrects_the_one_before_by_a_share() -> None:
    before = _guide(*STRAIGHT)
    before.aim(_at())
    aside = ((0.0, 2.0), (10.0, 2.0), (20.0, 2.0))
    track = Track()
    track.put(SEEN_NS, _at())
    after = _guide(*aside, track=track, share=0.5)
    after.continue_from(before)

    assert _bearing_rad(after.aim(_at(2.0, 1.0))) == pytest.approx(0.0, abs=1e-6)


def test_a_path_that_leads_elsewhere_takes_the_place_of_the_one_before() -> None:
    before = _guide(*STRAIGHT)
    before.aim(_at())
    aside = ((0.0, 0.0), (0.0, 10.0), (0.0, 20.0))
    after = _guide(*aside)
    after.continue_from(before)

    assert _bearing_rad(after.aim(_at())) > 1.5


@pytest.mark.parametrize(
    "parameters",
    [
        {},
        {"seen_ns": 0.5},
        {"seen_ns": 5, "ahead_1_m": 1.0, "left_1_m": 1.0},
        {"seen_ns": 5, "ahead_1_m": 1.0, "left_1_m": 1.0, "ahead_2_m": 2.0},
    ],
)
def test_a_path_without_a_stamp_or_a_place_is_refused(parameters: dict[str, Scalar]) -> None:
    with pytest.raises(MessageError):
        Guide(parameters, Config(), Track())


def _guided() -> tuple[Module, MotorProgram]:
    module = module_without_plan()
    module.feed(pose_delta(1))
    parameters = _parameters(*STRAIGHT, seen_ns=PERIOD_NS)
    (program,) = module.feed(action_of(1, ActionName.GUIDE, **parameters))  # type: ignore[arg-type]
    assert isinstance(program, MotorProgram)
    return module, program


def test_a_robot_without_a_plan_is_guided() -> None:
    module, _ = _guided()
    command = command_after(module, pose_delta(2, 1.0))

    assert command.left_wheel_rad_s == pytest.approx(command.right_wheel_rad_s)
    assert command.left_wheel_rad_s > 0.0


def test_a_restarted_motor_module_goes_on_along_the_path() -> None:
    _, program = _guided()
    after = module_without_plan()
    assert after.restore is not None
    after.restore([program])

    assert command_after(after, pose_delta(3, 2.0)).left_wheel_rad_s > 0.0
