"""`cogmap explain`: one moment of a recorded drive, for people and for programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click import UsageError as ClickUsageError
from click.testing import CliRunner

from cogmap.cli.main import cogmap
from cogmap.errors import LogError, UsageError
from cogmap.recording.storage.format import LOG_NAME
from tests.support.cycles import Cycles
from tests.support.logs import write_log
from tests.support.reference import REFERENCE


def explained(*arguments: str | Path) -> str:
    """What the command prints. Raises what it raises."""
    words = ["explain", *map(str, arguments)]
    result = CliRunner().invoke(cogmap, words, standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result.stdout


def facts(*arguments: str | Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(explained(*arguments, "--json"))
    return found


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """Six cycles: a broadcast in the first, in the fourth, and in the sixth."""
    cycles = Cycles()
    for cycle in range(1, 7):
        cycles.add(cycle, novelty=0.9, whereabouts=0.4)
    return write_log(tmp_path / "drive.mcap", cycles.rows)


def test_the_last_broadcast_of_the_reference_drive_is_explained() -> None:
    shown = explained(REFERENCE)
    found = facts(REFERENCE)

    assert found["broadcast"]["message"]["cycle"] == found["cycle"]
    assert found["winner"] == found["broadcast"]["message"]["coalition"]["id"]
    assert f"cycle {found['cycle']}, {found['driven_s']:.3f} s into the drive" in shown
    assert f"{found['at_s']:.3f} s into {REFERENCE}" in shown
    for name in ("perceived", "workspace", "competition", "conscious", "action", "command"):
        assert f"\n{name}" in shown


def test_a_moment_shows_what_was_perceived_competed_chosen_and_done(drive: Path) -> None:
    shown = explained(drive, "--cycle", "1")

    assert "library  12.0 m, 29° left" in shown
    assert "0.90  novelty      won      new  the agent, library" in shown
    assert "0.40  whereabouts  waiting  new" in shown
    assert "Novelty won as the most active, 0.50 ahead of whereabouts." in shown
    assert "the agent at (3.0, -1.0) m, heading 0°, library" in shown
    assert "It is coalition 1/novelty/0 of novelty, from cycle 1." in shown
    assert "0.40  halt          rejected: less active than the one chosen" in shown
    assert "The next best, halt, had 0.40: less active than the one chosen." in shown
    assert "drive straight ahead  10.0 and 10.0 rad/s" in shown


def test_each_stage_has_its_time_since_the_view(drive: Path) -> None:
    found = facts(drive, "--cycle", "1")

    assert found["percepts"]["after_ms"] == 0.0
    assert [commit["after_ms"] for commit in found["workspace"]] == [10.0, 20.0]
    assert found["competition"]["after_ms"] == 40.0
    assert found["action"]["after_ms"] == 50.0
    assert found["command"]["after_ms"] == 60.0


def test_programs_get_every_field_as_it_was_published(drive: Path) -> None:
    found = facts(drive, "--cycle", "1")
    contenders = found["competition"]["message"]["contenders"]
    behaviours = found["action"]["message"]["behaviours"]

    assert [each["fate"] for each in contenders] == ["won", "waiting"]
    assert [each["rejection"] for each in behaviours] == ["", "less active than the one chosen"]
    assert found["entered"] == {"1/novelty/0": 1, "1/whereabouts/0": 1}
    assert found["workspace"][1]["tasks"] == ["1/localization"]
    assert len(found["why_conscious"]) == 2


def test_a_run_is_named_by_its_folder(drive: Path, tmp_path: Path) -> None:
    drive.rename(tmp_path / LOG_NAME)

    assert facts(tmp_path)["cycle"] == facts(tmp_path / LOG_NAME)["cycle"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--at", "60"], r"covers 0\.010 s to 0\.560 s of its time, cycles 1 to 6: .* not 60 s"),
        (["--at", "0"], r"choose a time of these, not 0 s"),
        (["--cycle", "9"], r"cycles 1 to 6: choose one of these, not cycle 9"),
        (["--at", "0.2", "--cycle", "2"], r"--at and --cycle both name a moment: leave one out"),
        (["--picture", "a.gif"], r"--picture a\.gif: name a file that ends in \.png or \.svg"),
        (["--picture", "no/a.png"], r"there is no folder no: make it first"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_is_wrong_is_named_with_the_remedy(
    drive: Path, arguments: list[str], words: str
) -> None:
    with pytest.raises((UsageError, ClickUsageError), match=words):
        explained(drive, *arguments)


def test_a_log_without_broadcasts_or_actions_is_refused_in_a_sentence(tmp_path: Path) -> None:
    silent = Cycles()
    silent.add(1)
    idle = Cycles()
    idle.add(1, acts=False, novelty=0.9)

    without_broadcast = write_log(tmp_path / "silent.mcap", silent.rows)
    without_action = write_log(tmp_path / "idle.mcap", idle.rows)

    with pytest.raises(LogError, match=r"holds no global_workspace/broadcast and no action/selec"):
        explained(without_broadcast)
    with pytest.raises(LogError, match=r"holds no action/selected, so nothing .* `cogmap log info"):
        explained(without_action)
