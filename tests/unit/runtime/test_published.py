"""Counts of published messages that survive the process."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.errors import StorageError
from cogmap.runtime.state.published import PublishedCounts
from cogmap.schemas import topics


def count(path: Path, *numbers: int) -> None:
    """Publish so many messages of odometry, and of deltas, in one incarnation without an end."""
    counts = PublishedCounts(path)
    for topic, number in zip((topics.ODOMETRY, topics.DELTA), numbers, strict=True):
        for _ in range(number):
            counts.add(topic)


def test_counts_go_on_from_those_of_all_incarnations_before(tmp_path: Path) -> None:
    path = tmp_path / "sim.published"

    count(path, 3, 0)
    count(path, 4, 300)
    counts = PublishedCounts(path)

    assert counts.earlier(topics.ODOMETRY) == 7
    assert counts.earlier(topics.DELTA) == 300
    assert counts.earlier(topics.TASK) == 0


def test_counts_of_this_incarnation_are_not_among_the_earlier(tmp_path: Path) -> None:
    counts = PublishedCounts(tmp_path / "sim.published")

    counts.add(topics.ODOMETRY)

    assert counts.earlier(topics.ODOMETRY) == 0


def test_a_folder_that_cannot_be_made_names_the_file_and_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file")

    with pytest.raises(StorageError, match=r"cannot write .*state/sim.published.*with --state"):
        PublishedCounts(tmp_path / "state" / "sim.published")


def test_a_damaged_file_names_itself(tmp_path: Path) -> None:
    (tmp_path / "sim.published").write_bytes(b"\xff" * 128)

    with pytest.raises(StorageError, match=r"sim\.published is damaged: move it away"):
        PublishedCounts(tmp_path / "sim.published")
