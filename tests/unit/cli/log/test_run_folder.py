"""A run's folder in the place of its log."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.errors import LogError
from cogmap.recording.storage.format import LOG_NAME
from cogmap.testing import odometry
from tests.support.logs import SECOND_NS, write_log
from tests.support.system.commands import log_command, log_facts

MESSAGES = 3


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    messages = [(SECOND_NS * (100 + number), odometry(number)) for number in range(MESSAGES)]
    write_log(tmp_path / LOG_NAME, messages)
    return tmp_path


def test_what_is_in_the_log_of_a_run_is_shown_for_its_folder(folder: Path) -> None:
    assert log_facts("info", folder)["topics"] == log_facts("info", folder / LOG_NAME)["topics"]


def test_the_messages_of_a_run_are_printed_for_its_folder(folder: Path) -> None:
    printed = log_command("cat", folder, "odometry").stdout

    assert printed.count("--- odometry at") == MESSAGES


def test_a_run_can_be_compared_with_a_log_by_its_folder(folder: Path) -> None:
    assert log_facts("diff", folder, folder / LOG_NAME, "odometry")["same"]


def test_the_log_of_a_run_is_recovered_by_its_folder(folder: Path, tmp_path: Path) -> None:
    saved = log_facts("recover", folder, tmp_path / "saved.mcap")

    assert saved["messages"] >= MESSAGES


def test_a_folder_without_a_log_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=f"no log .*{LOG_NAME}"):
        log_command("info", tmp_path)
