"""A run's folder in the place of its log."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from cogmap.cli.dashboard.playback import Playback
from cogmap.cli.main import cogmap
from cogmap.errors import LogError
from cogmap.recording.storage.format import LOG_NAME
from cogmap.recording.storage.reader import LogReader
from cogmap.testing import odometry
from tests.support.logs import SECOND_NS, write_log
from tests.support.reference import REFERENCE
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


@pytest.fixture
def run_folder(tmp_path: Path) -> Path:
    """The folder of a run that is linked to, as runs/latest is."""
    folder = tmp_path / "runs" / "2026-01-01-120000"
    folder.mkdir(parents=True)
    (folder / LOG_NAME).write_bytes(REFERENCE.read_bytes())
    latest = folder.parent / "latest"
    latest.symlink_to(folder.name)
    return latest


@pytest.mark.parametrize(
    "words",
    [
        ["explain", "RUN"],
        ["log", "cat", "RUN", "odometry", "-n", "1"],
        ["log", "diff", "RUN", "RUN", "odometry"],
        ["log", "export", "RUN", "odometry", "--csv", "OUT"],
        ["log", "image", "RUN", "-o", "OUT.png"],
        ["log", "info", "RUN"],
        ["log", "map", "RUN", "-o", "OUT.png"],
        ["log", "perception", "RUN", "-o", "OUT.png"],
        ["log", "recover", "RUN", "OUT.mcap"],
        ["log", "summary", "RUN"],
    ],
    ids=" ".join,
)
def test_every_verb_takes_the_folder_of_a_run(
    run_folder: Path, tmp_path: Path, words: list[str]
) -> None:
    given = [
        word.replace("RUN", str(run_folder)).replace("OUT", str(tmp_path / "out")) for word in words
    ]

    result = CliRunner().invoke(cogmap, given)

    assert result.exit_code == 0, result.output


def test_schemes_are_looked_for_in_the_log_of_a_run(run_folder: Path) -> None:
    result = CliRunner().invoke(cogmap, ["schemes", str(run_folder)])

    assert isinstance(result.exception, LogError)
    assert "holds no guidance schemes" in str(result.exception)


def test_the_dashboard_plays_the_log_of_a_run(run_folder: Path) -> None:
    playback = Playback(run_folder)
    duration_s = playback.playing.duration_s
    playback.close()

    assert duration_s == LogReader(REFERENCE).span_s


def test_a_folder_without_a_log_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=f"no log .*{LOG_NAME}"):
        log_command("info", tmp_path)
