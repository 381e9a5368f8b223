"""The turns of wheels as odometry."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from cogmap.errors import UsageError
from cogmap.ros2.encoders import Encoders, WheelJoints

S = 10**9
JOINTS = WheelJoints("left", "right", radius_m=0.1, track_m=0.5)


def joints(left_rad: float, right_rad: float) -> SimpleNamespace:
    """What a robot with an arm says of its joints."""
    return SimpleNamespace(name=["arm", "right", "left"], position=[9.0, right_rad, left_rad])


def test_equal_turns_lead_ahead() -> None:
    encoders = Encoders(JOINTS)
    encoders.on_joints(S, joints(5.0, 5.0))

    rolled = encoders.on_joints(3 * S, joints(15.0, 15.0))

    assert rolled is not None
    assert rolled[0] == pytest.approx([1.0, 0.0, 0.0])
    assert rolled[1] == pytest.approx([0.5, 0.0])


def test_wheels_that_differ_lead_along_an_arc() -> None:
    encoders = Encoders(JOINTS)
    encoders.on_joints(0, joints(0.0, 0.0))
    quarter_rad = math.pi / 2 / 0.1  # a quarter of a circle of 1 m around what is on the left
    rolled = encoders.on_joints(S, joints(quarter_rad * 0.75, quarter_rad * 1.25))

    assert rolled is not None
    assert rolled[0] == pytest.approx([1.0, 1.0, math.pi / 2])
    assert rolled[1] == pytest.approx([math.pi / 2, math.pi / 2])


def test_joints_of_others_and_old_ones_are_ignored() -> None:
    encoders = Encoders(JOINTS)
    encoders.on_joints(S, joints(0.0, 0.0))

    assert encoders.on_joints(2 * S, SimpleNamespace(name=["arm"], position=[1.0])) is None
    assert encoders.on_joints(0, joints(9.0, 9.0)) is None


def test_wheels_without_positions_are_named() -> None:
    message = SimpleNamespace(name=["left", "right"], position=np.zeros(0))

    with pytest.raises(UsageError, match="the joints left and right have no positions"):
        Encoders(JOINTS).on_joints(S, message)
