"""Presets of the rules by which an agent localizes, closes loops, corrects and plans."""

from __future__ import annotations

import msgspec
import pytest

from cogmap.runtime import config
from cogmap.services import registry
from cogmap.services.codelets.rules import (
    OURS,
    PRESETS,
    RULES,
    described,
    rules_of,
    settings_of,
    with_rules,
)


def test_our_preset_has_the_defaults_of_the_settings() -> None:
    for rule, section in RULES.items():
        defaults = msgspec.to_builtins(config.typed({}, section, registry.config_type(section)))
        assert PRESETS[OURS][rule] == defaults[rule]


@pytest.mark.parametrize("preset", PRESETS)
def test_modules_accept_every_preset(preset: str) -> None:
    sections = config.load(None, settings_of(preset))

    assert rules_of(sections) == PRESETS[preset]
    for section in {*RULES.values()}:
        config.typed(sections, section, registry.config_type(section))


def test_a_setting_after_a_preset_overrides_it() -> None:
    sections = config.load(None, [*settings_of("paper"), "codelets.correct=heading"])
    assert rules_of(sections) == PRESETS["paper"] | {"correct": "heading"}


def test_a_preset_leaves_what_is_set_already() -> None:
    sections = with_rules({"codelets": {"closes_by": "agreement", "samples": 50}}, "paper")

    assert rules_of(sections) == PRESETS["paper"] | {"closes_by": "agreement"}
    assert sections["codelets"]["samples"] == 50


def test_rules_are_described_in_a_line() -> None:
    line = "rules: localization paper, closes_by sighting, correct eq9, planning gradient"
    assert described(PRESETS["paper"]) == line
