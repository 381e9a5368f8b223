"""The committed log of a small drive, held against what each module says today.

Sines, sums and image filters may round differently on another processor, so there most modules are
held against a log that is recorded on the spot. Two compute with nothing but additions, comparisons
and minima of single numbers, which are the same everywhere.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.recording.replaying.outcome import Outcome
from cogmap.recording.replaying.replay import replay_into
from cogmap.recording.storage.reader import LogReader
from schemas import topics
from schemas.sensing import MotorCommand
from services import registry
from tests.support.reference import FRAMES, REFERENCE, compared, drive, in_words, other_arithmetic

SAME_EVERYWHERE = ("workspace", "global_workspace")
ON_PURPOSE = "where this is meant to change: python -m tests.support.reference --update"


def _replayed(log: Path, module: str) -> Outcome:
    report = replay_into(log, [module], registry.build, processes=1)
    assert report.same, f"{report.first}; {ON_PURPOSE}"
    (outcome,) = report.outcomes
    return outcome


def _needs_the_same_arithmetic() -> None:
    if other := other_arithmetic():
        pytest.skip(
            f"this machine may round differently than the one that recorded the reference: {other}"
        )


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive recorded on this machine."""
    log = tmp_path_factory.mktemp("drive") / "fresh.mcap"
    drive(log=log)
    return log


@pytest.mark.parametrize("module", registry.MODULES)
def test_a_module_says_the_bytes_of_the_reference(module: str) -> None:
    if module not in SAME_EVERYWHERE:
        _needs_the_same_arithmetic()
    outcome = _replayed(REFERENCE, module)
    assert outcome.same >= FRAMES - 1
    assert (outcome.missing_inputs, outcome.extra_outputs, outcome.notes) == ({}, 0, [])


@pytest.mark.parametrize("module", registry.MODULES)
def test_a_module_says_the_bytes_of_a_drive_recorded_on_this_machine(
    fresh: Path, module: str
) -> None:
    assert _replayed(fresh, module).same >= FRAMES - 1


def test_a_drive_of_today_is_the_reference_on_every_topic(fresh: Path) -> None:
    _needs_the_same_arithmetic()
    changed = compared(REFERENCE, fresh)
    assert changed.same, f"{in_words(changed)}\n{ON_PURPOSE}"


def test_two_drives_on_this_machine_are_the_same_on_every_topic(
    fresh: Path, tmp_path: Path
) -> None:
    again = tmp_path / "again.mcap"
    drive(log=again)
    assert compared(fresh, again).same


def test_the_reference_is_small_and_holds_a_whole_drive() -> None:
    assert REFERENCE.stat().st_size < 1_500_000
    reader = LogReader(REFERENCE)
    commands = [reader.message(record) for record in reader.records({topics.MOTOR_COMMAND})]
    assert len(commands) == FRAMES
    assert any(isinstance(command, MotorCommand) and not command.halted_by for command in commands)


def test_a_change_is_told_topic_by_topic_with_the_first_difference_of_each(
    fresh: Path, tmp_path: Path
) -> None:
    shorter = tmp_path / "shorter.mcap"
    drive(3, log=shorter)
    told = in_words(compared(fresh, shorter))
    assert f"motor/command: 3 the same, 0 changed, {FRAMES - 3} gone, 0 new" in told
    assert (
        "motor/command number 3 of action (stamp 0.800 s) is in fresh.mcap and not in shorter.mcap"
        in told
    )
