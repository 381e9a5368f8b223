"""A drive from a script: its options become those of `cogmap run`, its end a result or an error."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from cogmap.cli.run.child import failure
from cogmap.cli.run.script import RunOptions, settings_of, summary_after, summary_in, words
from cogmap.errors import CogmapError, ConfigError, UsageError
from cogmap.services.codelets.rules import PRESETS, rules_of
from tests.support.world.summaries import summary, write_summary


def words_of(options: RunOptions) -> list[str]:
    with words(options, Path("there")) as given:
        return given


def test_options_are_those_of_the_command() -> None:
    options: RunOptions = {
        "seed": 3,
        "explore_s": 20.0,
        "lockstep": True,
        "energy": False,
        "record": False,
    }

    assert words_of(options) == [
        *("--out", "there"),
        *("--explore", "20.0"),
        "--lockstep",
        "--no-record",
        *("--seed", "3"),
    ]


def test_settings_override_those_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "base.toml"
    path.write_text("[sim]\ntown = 'blocks'\nseed = 4\n")
    noise = {"gyro_rad_s": 0.1}
    settings = {"sim.seed": np.int64(5), "sim.noise": noise, "motor.cruise_m_s": 2.0}

    with words({"config": path, "settings": settings}, Path("there")) as given:
        *_, flag, written = given
        read = tomllib.loads(Path(written).read_text())

    assert flag == "--config"
    assert read == {
        "sim": {"town": "blocks", "seed": 5, "noise": noise},
        "motor": {"cruise_m_s": 2.0},
    }
    assert not Path(written).exists()


def test_rules_override_the_file_and_settings_override_rules(tmp_path: Path) -> None:
    path = tmp_path / "base.toml"
    path.write_text("[codelets]\ncorrect = 'heading'\nsamples = 90\n")
    own = {"planning.planning": "hierarchy"}

    options: RunOptions = {"config": path, "rules": "paper", "settings": own}
    chosen = settings_of(options)

    assert chosen["codelets"]["samples"] == 90
    assert rules_of(chosen) == PRESETS["paper"] | {"planning": "hierarchy"}
    assert "--rules" not in words_of(options)


def test_rules_that_there_are_not_are_named() -> None:
    with pytest.raises(UsageError, match="rules 'papers': choose paper or spiking or cogmap"):
        settings_of({"rules": "papers"})


def test_the_file_of_settings_may_be_that_of_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "base.toml"
    path.write_text("sim.seed = 4")
    monkeypatch.setenv("COGMAP_CONFIG", str(path))

    assert settings_of({}) == {"sim": {"seed": 4}}


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"seed": 1}, "the setting 'seed': name it as module.key"),
        ({"sim.seed": None}, "the setting sim.seed cannot be None"),
    ],
)
def test_a_setting_that_cannot_be_is_named(settings: dict[str, object], sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        settings_of({"settings": settings})


def test_the_error_of_a_drive_is_the_last_that_it_showed() -> None:
    of_usage = failure(2, "Usage: ...\n\nError: No such option '--sed'.\n")
    of_ours = failure(1, "files in runs/1\ncogmap: the disk is full\n")

    assert (type(of_usage), str(of_usage)) == (UsageError, "No such option '--sed'.")
    assert (type(of_ours), str(of_ours)) == (CogmapError, "the disk is full")
    assert "ended with code -9" in str(failure(-9, ""))


def test_the_summary_of_another_drive_is_not_taken_for_its_own(tmp_path: Path) -> None:
    write_summary(tmp_path, summary(seed=3))

    assert summary_after(tmp_path, 1, "").seed == 3
    with pytest.raises(UsageError, match="exists already"):
        summary_after(tmp_path, 2, "cogmap: there exists already")


def test_a_summary_that_is_missing_or_cut_is_none(tmp_path: Path) -> None:
    assert summary_in(tmp_path) is None

    (tmp_path / "summary.json").write_text('{"seed": 1')
    assert summary_in(tmp_path) is None
