"""The settings of a running system."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from cogmap.bus.codec import encode
from cogmap.bus.interface import Answer
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.cli.main import cogmap
from cogmap.cli.param import settings_of, text, value_named
from cogmap.errors import ConfigError, NoAnswerError, UsageError
from cogmap.runtime.config import Sections
from cogmap.schemas import topics
from cogmap.schemas.process import Settings
from cogmap.services import registry
from cogmap.services.motor.config import Config as MotorConfig


def told(toml: str) -> Sections:
    """The settings that a process tells."""
    network = MemoryNetwork()
    answer = Answer(encode(Settings(instance="motor", toml=toml)), None)
    server = MemoryBus(network)
    server.serve(topics.SETTINGS_REQUEST, topics.SETTINGS, lambda _: answer, lambda job: job())
    return settings_of(MemoryBus(network), 1.0)


def test_keys_that_are_not_told_have_their_default() -> None:
    sections = told("[motor]\ncruise_m_s = 1.25\n")

    assert sections.keys() == set(registry.sections())
    assert value_named("motor.cruise_m_s", sections) == 1.25
    assert value_named("motor.braking_m_s2", sections) == MotorConfig().braking_m_s2


def test_sections_of_modules_of_others_are_there_too() -> None:
    assert told("[wanderer]\nspeed = 3\n")["wanderer"] == {"speed": 3}


def test_where_nobody_answers_that_is_said() -> None:
    with pytest.raises(NoAnswerError, match="settings_request"):
        settings_of(MemoryBus(MemoryNetwork()), 1.0)


def test_an_answer_that_is_no_toml_is_none() -> None:
    with pytest.raises(NoAnswerError, match="no settings"):
        told("motor = [")


@pytest.mark.parametrize(
    ("name", "meant"),
    [("moter.cruise_m_s", "did you mean 'motor'"), ("motor.cruise", "did you mean 'cruise_m_s'")],
)
def test_a_mistyped_setting_names_the_nearest(name: str, meant: str) -> None:
    with pytest.raises(UsageError, match=meant):
        value_named(name, told(""))


@pytest.mark.parametrize(
    ("value", "written"), [(1.5, "1.5"), (True, "true"), ("blocks", "blocks"), ([1, 2], "[1,2]")]
)
def test_values_are_written_as_set_takes_them(value: object, written: str) -> None:
    assert text(value) == written


def set_(*arguments: str) -> None:
    """`cogmap param set`. Raises what it raises."""
    result = CliRunner().invoke(cogmap, ["param", "set", *arguments], standalone_mode=False)
    assert result.exception is not None
    raise result.exception


def test_set_names_the_option_that_starts_with_another_value() -> None:
    with pytest.raises(UsageError, match=r"cogmap run --set motor\.cruise_m_s=2"):
        set_("motor.cruise_m_s", "2")


@pytest.mark.parametrize("arguments", [("motor.cruise", "2"), ("motor.cruise_m_s", "fast")])
def test_set_refuses_what_could_not_be_started_with(arguments: tuple[str, str]) -> None:
    with pytest.raises(ConfigError, match="motor"):
        set_(*arguments)
