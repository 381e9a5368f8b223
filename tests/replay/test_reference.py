"""The committed log of a small drive, compared with what each module publishes today.

Sines, sums and image filters may round differently on another processor, so there most modules are
compared with a log that is recorded on the spot. One computes with nothing but additions,
comparisons and minima of single numbers, which are the same everywhere.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.recording.replaying.outcome import Outcome
from cogmap.recording.replaying.replay import replay_into
from cogmap.recording.storage.reader import LogReader
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.sensing import MotorCommand
from cogmap.services import registry
from tests.support.reference import (
    FRAMES,
    REFERENCE,
    compared,
    drive,
    in_words,
    other_arithmetic,
    sections,
)

SAME_EVERYWHERE = ("global_workspace",)
# Those that take part in a drive through a simulated town: the player takes the simulation's place.
TAKING_PART = [name for name in registry.MODULES if name != "player"]
MAX_BYTES = 1_500_000
# The first cycle has no broadcast, and the last may end before its own is answered.
MIN_OUTPUTS = FRAMES - 2
ON_PURPOSE = "where this is meant to change: python -m tests.support.reference --update"


def _build(name: str, _: Sections, instance: str) -> Module:
    """A module with the settings of today: one that is gone needs no new reference."""
    return registry.build(name, sections(), instance)


def _replayed(log: Path, module: str) -> Outcome:
    report = replay_into(log, [module], _build, processes=1)
    assert report.same, f"{report.first}; {ON_PURPOSE}"
    (outcome,) = report.outcomes
    return outcome


def _needs_the_same_arithmetic() -> None:
    other = other_arithmetic()
    if other:
        pytest.skip(
            f"this machine may round differently than the one that recorded the reference: {other}"
        )


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive recorded on this machine."""
    log = tmp_path_factory.mktemp("drive") / "fresh.mcap"
    drive(log=log)
    return log


@pytest.mark.parametrize("module", TAKING_PART)
def test_a_module_publishes_the_bytes_of_the_reference(module: str) -> None:
    if module not in SAME_EVERYWHERE:
        _needs_the_same_arithmetic()

    outcome = _replayed(REFERENCE, module)

    assert outcome.same >= MIN_OUTPUTS
    assert outcome.missing_inputs == {}
    assert outcome.extra_outputs == 0
    assert outcome.notes == []


@pytest.mark.parametrize("module", TAKING_PART)
def test_a_module_publishes_the_bytes_of_a_drive_on_this_machine(fresh: Path, module: str) -> None:
    outcome = _replayed(fresh, module)

    assert outcome.same >= MIN_OUTPUTS


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
    reader = LogReader(REFERENCE)
    commands = []
    for record in reader.records({topics.MOTOR_COMMAND}):
        command = reader.message(record)
        assert isinstance(command, MotorCommand)
        commands.append(command)

    assert REFERENCE.stat().st_size < MAX_BYTES
    assert len(commands) == FRAMES
    assert any(not command.halted_by for command in commands)


def test_a_change_is_printed_by_topic_with_the_first_difference_of_each(
    fresh: Path, tmp_path: Path
) -> None:
    shorter = tmp_path / "shorter.mcap"
    drive(3, log=shorter)

    printed = in_words(compared(fresh, shorter))

    first = "motor/command number 3 of motor (stamp 0.800 s)"
    assert f"motor/command: 3 the same, 0 changed, {FRAMES - 3} gone, 0 new" in printed
    assert f"{first} is in fresh.mcap and not in shorter.mcap" in printed
