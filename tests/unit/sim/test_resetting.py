"""A robot that is carried back to where it began."""

from __future__ import annotations

import math

import pytest

from cogmap.runtime.module import Module
from cogmap.runtime.run import LOCKSTEP
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import (
    MotorCommand,
    Percepts,
    Pose,
    Reset,
    SelfMotion,
    StereoFrame,
    TruePose,
)
from cogmap.services.sim.module import Config, build
from cogmap.testing import of_type

CAMERAS = Config(egl=False, width_px=64, height_px=64)
PERCEPTS = Config(sensing="percepts")
FASTEST_M = 0.5
"""Farther than the robot drives in a view of a fifth of a second from rest."""


def _drive(module: Module, views: int, before: list[Message]) -> list[Message]:
    """What is published while so many views are answered, after what was `before`."""
    messages = before
    for _ in range(views):
        messages = messages + _answered(module, messages, wheels_rad_s=9.0)
    return messages


def _answered(module: Module, before: list[Message], wheels_rad_s: float) -> list[Message]:
    """What is published as the last view before is answered."""
    view = [*of_type(Percepts, before), *of_type(StereoFrame, before)][-1]
    command = MotorCommand(
        stamp_ns=view.stamp_ns, left_wheel_rad_s=wheels_rad_s, right_wheel_rad_s=wheels_rad_s
    )
    return module.feed(command)


def _started(config: Config) -> tuple[Module, list[Message]]:
    module = build(config, run=LOCKSTEP)
    assert module.start is not None
    return module, module.stamp(module.start())


def _apart_m(a: Pose, b: Pose) -> float:
    return math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)


@pytest.mark.parametrize("config", [CAMERAS, PERCEPTS], ids=["cameras", "percepts"])
def test_the_robot_goes_on_from_its_start_and_time_goes_on(config: Config) -> None:
    module, first = _started(config)
    driven = of_type(TruePose, _drive(module, 12, first))
    (carried,) = of_type(TruePose, module.feed(Reset()))

    assert _apart_m(driven[0].pose, driven[-1].pose) > FASTEST_M
    assert _apart_m(driven[0].pose, carried.pose) < 1e-3
    assert carried.resets == 1
    assert carried.stamp_ns == driven[-1].stamp_ns
    assert carried.travelled_m == driven[-1].travelled_m


def test_the_way_back_is_not_measured() -> None:
    module, first = _started(PERCEPTS)
    messages = _drive(module, 12, first)
    module.feed(Reset())
    (motion,) = of_type(SelfMotion, _answered(module, messages, wheels_rad_s=0.0))[-1:]

    assert motion.motions.numpy()[:, 0] == pytest.approx(0.0)


def test_before_any_reset_the_true_pose_has_no_number_of_them() -> None:
    _, first = _started(PERCEPTS)

    assert not of_type(TruePose, first)[0].resets


def test_a_robot_that_was_carried_back_drives_alike_each_time() -> None:
    def driven() -> list[Message]:
        module, first = _started(PERCEPTS)
        before = _drive(module, 5, first)
        return _drive(module, 5, [*before, *module.feed(Reset())])

    assert driven() == driven()
