"""`cogmap town`: an example, and pictures of towns."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from cogmap.cli.launch.plan import Choices, effective
from cogmap.cli.main import cogmap
from cogmap.cli.town.command import EXAMPLE
from cogmap.errors import ConfigError


def _said(*words: str) -> str:
    return CliRunner().invoke(cogmap, words, catch_exceptions=False).output


def test_the_example_is_a_town_that_can_be_driven_in(tmp_path: Path) -> None:
    written = _said("town", "example")

    assert written == EXAMPLE.read_text()
    assert len(tomllib.loads(written)["street"]) == 4


def test_a_town_is_drawn_with_what_it_has(tmp_path: Path) -> None:
    picture = tmp_path / "mine.png"
    said = _said("town", "show", str(EXAMPLE), "-o", str(picture))

    assert said == f"{picture}: 4 streets, 17 buildings\n"
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["village", "none.toml"])
def test_a_town_that_is_not_there_is_refused_with_the_remedy(name: str) -> None:
    result = CliRunner().invoke(cogmap, ["town", "show", name])

    assert isinstance(result.exception, ConfigError)
    assert name in str(result.exception)
    assert ".toml" in str(result.exception)


def test_the_agent_is_given_the_goals_that_are_written() -> None:
    sections = effective({}, Choices(town=str(EXAMPLE)), observer=True)
    cinema, pier = sections["workspace"]["goals"]

    assert (cinema["name"], cinema["object"]) == ("cinema", "cinema")
    assert (pier["object"], pier["x_m"], pier["y_m"]) == ("", 115.0, 25.0)
    assert sections["sim"]["ends_at_goal"]


def test_goals_of_ones_own_come_before_those_that_are_written() -> None:
    base = {"workspace": {"goals": [{"name": "home"}]}}
    sections = effective(base, Choices(town=str(EXAMPLE)), observer=True)

    assert [goal["name"] for goal in sections["workspace"]["goals"]] == ["home"]
