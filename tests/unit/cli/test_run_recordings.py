"""What a run takes from the recording that it plays."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.cli.launch.plan import Choices
from cogmap.cli.run.options import AROUND_S, formats_of_recordings
from cogmap.cli.run.recordings import chosen, limit_s, with_settings
from cogmap.errors import UsageError
from cogmap.services.player.formats import FORMATS
from tests.support.recordings import Walk


def test_the_recording_is_named_by_the_option_or_the_settings() -> None:
    by_option = chosen(Choices(recording="kitti:07"), {})
    by_setting = chosen(Choices(), {"player": {"recording": "kitti:07"}})

    assert by_option == by_setting
    assert by_option.recording == f"kitti:{Path.cwd() / '07'}"


def test_a_drive_without_a_recording_stays_as_it_is() -> None:
    choices = Choices(town="blocks", seed=3)

    assert chosen(choices, {}) is choices


@pytest.mark.parametrize(
    ("choices", "word"),
    [
        (Choices(town="blocks"), "--town"),
        (Choices(seed=0), "--seed"),
        (Choices(laps=1.0), "--laps"),
        (Choices(energy=True), "--energy"),
        (Choices(explore_s=10.0), "--explore"),
    ],
)
def test_what_a_recording_leaves_no_choice_of_is_named(choices: Choices, word: str) -> None:
    with pytest.raises(UsageError, match=word):
        chosen(choices, {"player": {"recording": "kitti:07"}})


def test_a_speed_without_a_recording_is_refused() -> None:
    with pytest.raises(UsageError, match="--recording"):
        chosen(Choices(speed=2.0), {})


def test_settings_of_the_user_come_before_those_that_the_recording_asks_for() -> None:
    recording = Walk(2, settings={"codelets": {"samples": 100, "landmarks": "points"}})

    sections = with_settings({"codelets": {"samples": 500}, "epam": {}}, recording)

    assert sections == {"codelets": {"samples": 500, "landmarks": "points"}, "epam": {}}


def test_the_time_limit_follows_the_recording() -> None:
    recording = Walk(51)
    real: dict[str, dict[str, object]] = {"run": {"lockstep": False}, "player": {"speed": 2.0}}
    stepped: dict[str, dict[str, object]] = {"run": {"lockstep": True}}

    assert limit_s(recording, real) == pytest.approx(5.0 + AROUND_S)
    assert limit_s(recording, stepped) > 51 + AROUND_S


def test_the_help_lists_every_format() -> None:
    assert all(f"{name}:PATH" in formats_of_recordings() for name in FORMATS)
