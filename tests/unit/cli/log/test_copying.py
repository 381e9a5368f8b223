"""`cogmap log filter`, `merge` and `cat` of a part of a log."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.errors import UsageError
from cogmap.recording.storage.reader import LogReader
from tests.support.reference import REFERENCE
from tests.support.system.commands import log_command, log_facts


def test_a_part_of_a_log_is_written_and_counted(tmp_path: Path) -> None:
    target = tmp_path / "part.mcap"

    facts = log_facts("filter", REFERENCE, target, "-e", "^truth/", "-x", "town")

    assert set(facts["messages"]) == {"truth/pose"}
    assert facts["path"] == str(target)


def test_parts_of_a_log_are_merged_to_the_log_again(tmp_path: Path) -> None:
    parts = [tmp_path / "one.mcap", tmp_path / "two.mcap"]
    middle_s = str(LogReader(REFERENCE).span_s / 2)
    log_command("filter", REFERENCE, parts[0], "--until", middle_s)
    log_command("filter", REFERENCE, parts[1], "--start-offset", middle_s)

    log_command("merge", *parts, "-o", tmp_path / "whole.mcap", "--compression", "zstd")

    assert log_facts("diff", REFERENCE, tmp_path / "whole.mcap")["same"]


def test_messages_are_printed_up_to_a_time() -> None:
    printed = log_command("cat", REFERENCE, "odometry", "--until", "0.5").stdout
    every = log_command("cat", REFERENCE, "odometry").stdout

    assert 0 < printed.count("--- odometry") < every.count("--- odometry")


def test_messages_are_printed_by_a_condition() -> None:
    words = ("cat", REFERENCE, "motor/command", "--field", "slowed_by", "--csv")
    printed = log_command(*words, "--filter", "slowed_by == obstacle").stdout

    assert set(printed.split()) == {"obstacle"}


def test_a_field_is_one_of_a_topic() -> None:
    with pytest.raises(UsageError, match="for the messages of one topic: name it"):
        log_command("cat", REFERENCE, "--field", "seq")


def test_a_time_after_the_end_of_a_part_is_refused() -> None:
    with pytest.raises(UsageError, match="--until 1: it must be later than --start-offset 2"):
        log_command("cat", REFERENCE, "--start-offset", "2", "--until", "1")
