"""Types of messages, as `cogmap interface` shows them."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner
from msgspec import inspect

from cogmap.cli.messages.interface import interface, struct_named
from cogmap.cli.messages.types import messages_and_parts, unit_of, words
from cogmap.errors import UsageError
from cogmap.schemas import topics
from cogmap.schemas.nodes import Goal
from cogmap.schemas.sensing import Odometry, Percept


def test_every_message_is_listed_with_its_topic() -> None:
    printed = CliRunner().invoke(interface, ["list", "-m"]).output

    assert printed.splitlines() == [f"{topic.type.__name__}  {topic.name}" for topic in topics.ALL]


def test_parts_are_listed_however_deep_they_are() -> None:
    assert {"Percept", "Calibration", "Goal"} <= set(messages_and_parts())


@pytest.mark.parametrize("name", ["Odometry", "odometry", "/odometry", "ODOMETRY"])
def test_a_type_is_found_by_its_name_or_its_topic(name: str) -> None:
    assert struct_named(name) is Odometry


def test_a_part_has_no_topic_and_a_node_its_tag() -> None:
    assert struct_named("percept") is Percept
    shown = json.loads(CliRunner().invoke(interface, ["show", "Goal", "--json"]).stdout)

    assert struct_named("Goal") is Goal
    assert shown["topic"] == ""
    assert shown["fields"][0] == {"name": "type", "type": "goal", "unit": "", "default": ""}


def test_a_type_that_does_not_exist_is_named_with_the_nearest() -> None:
    with pytest.raises(UsageError, match="no type of message 'Odometr': did you mean 'Odometry'"):
        struct_named("Odometr")


def test_a_field_has_type_unit_and_default() -> None:
    shown = json.loads(CliRunner().invoke(interface, ["show", "odometry", "--json"]).stdout)
    fields = {field["name"]: field for field in shown["fields"]}

    assert shown["name"] == "Odometry"
    assert "Wheel odometry" in shown["description"]
    assert fields["stamp_ns"]["type"] == "int, at least 0"
    assert fields["stamp_ns"]["default"] == "0"
    assert fields["speed_m_s"]["unit"] == "m/s"
    assert fields["speed_m_s"]["default"] == ""
    assert fields["dt_s"]["type"] == "float, above 0 to 10"


@pytest.mark.parametrize("struct", messages_and_parts().values(), ids=lambda each: each.__name__)
def test_every_type_of_a_field_has_words(struct: type) -> None:
    kind = inspect.type_info(struct)
    assert isinstance(kind, inspect.StructType)

    for field in kind.fields:
        assert "Type" not in words(field.type)


@pytest.mark.parametrize(
    ("name", "unit"), [("x_m", "m"), ("turn_rate_rad_s", "rad/s"), ("memory_mb", "MB"), ("seq", "")]
)
def test_the_unit_is_that_which_the_name_states(name: str, unit: str) -> None:
    assert unit_of(name) == unit
