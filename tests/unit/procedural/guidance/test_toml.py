"""Guidance schemes are written as a file of schemes has them, and read again."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.errors import ConfigError
from cogmap.services.procedural.guidance.toml import written
from cogmap.services.procedural.loading import load, load_guidance
from tests.support.world.guidance import guidance
from tests.support.world.schemes import FOLLOW, HEADER
from tests.support.world.schemes import written as file_of

SCHEMES = (guidance("guide_1", executions=3, successes=2), guidance('the "other"', 5 + 0j))


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    path = file_of(tmp_path, written(SCHEMES))

    first, second = load_guidance(path)

    assert load(path) == []
    assert (first.name, first.executions, first.successes) == ("guide_1", 3, 2)
    assert second.name == 'the "other"'
    assert first.path_m == SCHEMES[0].path_m
    for read, known in zip(first.landmarks, SCHEMES[0].landmarks, strict=True):
        assert read.look == known.look
        assert read.range_m == pytest.approx(known.range_m, abs=1e-3)
        assert read.bearing_rad == pytest.approx(known.bearing_rad, abs=1e-4)


@pytest.mark.parametrize(
    ("good", "bad", "complaint"),
    [
        ("executions = 3", "executed = 3", "unknown field `executed`"),
        ("successes = 2", "successes = 4", "more successes than executions"),
        ('name = "guide_1"', 'name = "follow"', "two schemes are named 'follow'"),
        ("path_m = [[0.000, 0.000], [10.000, 0.000]]", "path_m = []", "length >= 1"),
    ],
)
def test_what_is_wrong_is_named_by_file_and_line(
    good: str, bad: str, complaint: str, tmp_path: Path
) -> None:
    text = HEADER + FOLLOW + written(SCHEMES)
    assert good in text
    wrong = text.replace(good, bad, 1)
    path = file_of(tmp_path, wrong)
    number = max(n for n, line in enumerate(wrong.splitlines(), 1) if line == bad)

    with pytest.raises(ConfigError, match=complaint) as caught:
        load_guidance(path)

    assert str(caught.value).startswith(f"{path}:{number}: ")
