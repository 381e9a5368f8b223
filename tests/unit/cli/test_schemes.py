"""`cogmap schemes`: what was learned on a drive, as a file of schemes."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from cogmap.cli.main import cogmap
from cogmap.errors import LogError, StorageError
from cogmap.schemas.cognition import Behaviours, GuidanceScheme
from cogmap.services.procedural.loading import load_guidance
from tests.support.logs import SECOND_NS, write_log
from tests.support.world.guidance import guidance


def _log(folder: Path, *learned: list[GuidanceScheme]) -> Path:
    """A log with what was learned in each of its cycles."""
    rows = []
    for cycle, schemes in enumerate(learned, start=1):
        message = Behaviours(seq=cycle, cycle=cycle, behaviours=[], learned=schemes)
        rows.append((cycle * SECOND_NS, message))
    return write_log(folder / "drive.mcap", rows)


def _printed(*arguments: str | Path) -> str:
    words = ["schemes", *map(str, arguments)]
    result = CliRunner().invoke(cogmap, words, standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result.stdout


def test_what_was_learned_is_written_as_it_was_judged_last(tmp_path: Path) -> None:
    judged = guidance("guide_1", executions=2, successes=1)
    log = _log(tmp_path, [guidance("guide_1")], [guidance("guide_2")], [judged])
    out = tmp_path / "route.toml"

    assert _printed(log, "--out", out) == f"{out}: 2 guidance schemes\n"
    assert out.read_text() == _printed(log)
    first, second = load_guidance(out)
    assert (first.name, first.executions, first.successes) == ("guide_1", 2, 1)
    assert second.name == "guide_2"


def test_a_drive_that_taught_nothing_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="holds no guidance schemes"):
        _printed(_log(tmp_path, []))


def test_a_file_that_is_there_is_not_overwritten(tmp_path: Path) -> None:
    log = _log(tmp_path, [guidance()])
    out = tmp_path / "route.toml"
    out.write_text("mine")

    with pytest.raises(StorageError, match="exists already"):
        _printed(log, "--out", out)
    assert out.read_text() == "mine"
