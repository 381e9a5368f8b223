"""What configuration promises whoever writes it."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from cogmap.errors import ConfigError
from cogmap.runtime import config


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    speed_m_s: float = 2.0
    turns: list[str] = []
    seed: int = 7


def typed(*settings: str) -> Config:
    sections = config.load(None, settings)
    return config.typed(sections, "action", Config)


def test_defaults_hold_where_nothing_is_set() -> None:
    assert typed() == Config()


def test_a_setting_overrides_the_file(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text('[action]\nspeed_m_s = 1.5\nseed = 9\nturns = ["left"]\n')

    sections = config.load(tmp_path / "c.toml", ["action.seed=11"])

    assert config.typed(sections, "action", Config) == Config(
        speed_m_s=1.5, seed=11, turns=["left"]
    )


@pytest.mark.parametrize(
    ("setting", "value"),
    [("action.turns=['left', 'right']", ["left", "right"]), ("action.turns=[]", [])],
)
def test_a_setting_is_read_as_toml(setting: str, value: list[str]) -> None:
    assert typed(setting).turns == value


@pytest.mark.parametrize(
    ("setting", "sentence"),
    [
        ("action.sped_m_s=3", r"unknown key 'sped_m_s' in \[action\]: did you mean 'speed_m_s'\?"),
        ("action.colour=3", r"unknown key 'colour' in \[action\]: it has speed_m_s, turns, seed"),
        (
            "action.speed_m_s=fast",
            r"\[action\] Expected `float`, got `str` - at `action.speed_m_s`",
        ),
        ("action.turns=[1]", r"\[action\] Expected `str`, got `int` - at `action.turns\[0\]`"),
        ("action.speed_m_s=nan", r"action.speed_m_s is nan: write a finite number"),
        ("action.speed_m_s=-inf", r"action.speed_m_s is -inf: write a finite number"),
        ("action.turns=[{x = [1.0, inf]}]", r"action.turns\[0\].x\[1\] is inf: write a finite"),
        ("speed_m_s=3", r"--set speed_m_s=3: write it as module.key=value"),
        ("action.speed_m_s", r"--set action.speed_m_s: write it as module.key=value"),
    ],
)
def test_a_wrong_setting_names_itself_and_what_would_be_right(setting: str, sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        typed(setting)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[acton]\nseed = 1", r"unknown section \[acton\]: did you mean 'action'\?"),
        ("[zoo]\nseed = 1", r"unknown section \[zoo\]: it has action, sim"),
        ("action = 3", r"action must be a section \[action\] with keys in it"),
    ],
)
def test_a_wrong_section_names_itself(tmp_path: Path, text: str, sentence: str) -> None:
    (tmp_path / "c.toml").write_text(text)
    sections = config.load(tmp_path / "c.toml")

    with pytest.raises(ConfigError, match=sentence):
        config.check_sections(sections, ["sim", "action"])


def test_a_setting_of_a_section_that_is_none_names_the_section(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text("action = 3")

    with pytest.raises(ConfigError, match=r"action must be a section \[action\]"):
        config.load(tmp_path / "c.toml", ["action.seed=1"])


@pytest.mark.parametrize("content", [b"[action\n", b"\xff\xfe", b"a = 1\na = 2"])
def test_a_file_that_is_no_toml_names_itself(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "c.toml").write_bytes(content)

    with pytest.raises(ConfigError, match=r"cannot read .*c\.toml as TOML"):
        config.load(tmp_path / "c.toml")


def test_a_missing_file_names_itself_and_the_remedy(tmp_path: Path) -> None:
    sentence = r"no configuration file .*none\.toml: name one that exists"

    with pytest.raises(ConfigError, match=sentence):
        config.load(tmp_path / "none.toml")


def test_a_folder_for_a_file_names_itself(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot read"):
        config.load(tmp_path)
