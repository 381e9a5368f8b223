"""Rows of the table for modules of other packages."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import pytest

from cogmap.bus.access import site
from cogmap.bus.access.others import everybody, read
from cogmap.bus.access.subjects import SUBJECTS
from cogmap.errors import AccessError
from cogmap.schemas import topics

NOW = datetime(2026, 1, 1, tzinfo=UTC)
WANDERER = """
[wanderer]
publishes = ["motor/program"]
subscribes = ["clock", "workspace/delta"]
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "modules.toml"
    path.write_text(text)
    return path


def test_a_row_is_that_of_a_module_with_its_health_and_settings(tmp_path: Path) -> None:
    wanderer = read(written(tmp_path, WANDERER))["wanderer"]

    assert wanderer.publishes == {topics.MOTOR_PROGRAM, topics.HEALTH}
    assert wanderer.subscribes == {topics.CLOCK, topics.DELTA}
    assert wanderer.asks == {topics.SNAPSHOT_REQUEST}
    assert wanderer.may_be("wanderer", "any")


def test_a_site_keeps_the_rows_and_makes_keys_for_them(tmp_path: Path) -> None:
    folder = tmp_path / "site"
    path = written(tmp_path, WANDERER)

    assert "wanderer" in site.make(folder, NOW, modules=path)
    assert site.make(folder, NOW, renews_all=True)[-1] == "wanderer"
    assert everybody(folder / "router").keys() == {*SUBJECTS, "wanderer"}
    config = json.loads((folder / "router" / "router.json5").read_text())
    subjects = [each["id"] for each in config["access_control"]["subjects"]]
    assert subjects[-1] == "wanderer"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[motor]", "no module of yours can be called 'motor'"),
        ("['a/b']", "no module of yours can be called 'a/b'"),
        ("[a]\npublishes = ['nowhere']", "there is no topic 'nowhere'"),
        ("[a]\nlistens = []", "has no rows of modules"),
        ("[a", "has no rows of modules"),
    ],
)
def test_a_row_that_is_none_is_said(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(AccessError, match=said):
        read(written(tmp_path, text))
