"""Conditions on the fields of messages."""

from __future__ import annotations

import pytest
from msgspec import structs

from cogmap.cli.messages.condition import parsed
from cogmap.errors import UsageError
from cogmap.schemas import topics
from cogmap.schemas.sensing import MotorCommand, Odometry, SpeedLimit
from cogmap.schemas.topics import Topic
from cogmap.testing import percept, percepts

ODOMETRY = Odometry(speed_m_s=1.5, turn_rate_rad_s=-0.5, dt_s=0.05, stamp_ns=7, source="sim")
HALTED = MotorCommand(left_wheel_rad_s=0.0, right_wheel_rad_s=0.0, halted_by=SpeedLimit.OBSTACLE)


@pytest.mark.parametrize(
    ("written", "holds"),
    [
        ("speed_m_s == 1.5", True),
        ("speed_m_s > 1.5", False),
        ("speed_m_s>=1.5", True),
        ("turn_rate_rad_s < 0 and source == sim", True),
        ("turn_rate_rad_s < 0 and source == replay", False),
        ("source != 'sim'", False),
        ('source == "sim"', True),
        ("stamp_ns == 7", True),
    ],
)
def test_a_condition_compares_fields_with_values(written: str, holds: bool) -> None:
    assert parsed(written, topics.ODOMETRY).holds(ODOMETRY) == holds


def test_whole_numbers_are_compared_exactly() -> None:
    message = structs.replace(ODOMETRY, stamp_ns=2**60 + 1)

    assert parsed(f"stamp_ns == {2**60 + 1}", topics.ODOMETRY).holds(message)
    assert not parsed(f"stamp_ns == {2**60}", topics.ODOMETRY).holds(message)


def test_a_value_of_a_list_of_words_is_compared_by_its_word() -> None:
    assert parsed("halted_by == obstacle", topics.MOTOR_COMMAND).holds(HALTED)


def test_a_message_without_the_field_is_not_meant() -> None:
    condition = parsed("objects.0.label == inn", topics.PERCEPTS)

    assert condition.holds(percepts(0, percept("inn")))
    assert not condition.holds(percepts(0))


def test_without_a_condition_every_message_is_meant() -> None:
    assert parsed(None, topics.ODOMETRY).holds(ODOMETRY)


@pytest.mark.parametrize(
    ("topic", "written", "sentence"),
    [
        (topics.ODOMETRY, "speed > 1", "no 'speed' .*: did you mean 'speed_m_s'"),
        (topics.ODOMETRY, "speed_m_s > fast", "'fast' is not a number"),
        (topics.ODOMETRY, "speed_m_s > nan", "'nan' is not a number"),
        (topics.ODOMETRY, "source > 3", "> compares numbers: use == or !="),
        (topics.ODOMETRY, "speed_m_s", "'speed_m_s' is no comparison"),
        (topics.ODOMETRY, "speed_m_s > 1 and", "is no comparison"),
        (topics.ODOMETRY, "", "is no comparison"),
        (topics.ODOMETRY, "__class__ == 1", "no '__class__'"),
        (topics.MOTOR_COMMAND, "halted_by == obstacl", "did you mean 'obstacle'"),
        (topics.PERCEPTS, "objects == 3", "it is no single value"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_the_remedy(
    topic: Topic, written: str, sentence: str
) -> None:
    with pytest.raises(UsageError, match=f"^--filter .*{sentence}"):
        parsed(written, topic)
