"""The time limit of a drive."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

from cogmap.cli.launch.drive import FIRST_POSE, Drive
from cogmap.cli.launch.plan import Choices


def after_100_s(folder: Path, reached_s: Mapping[str, float], limits_start: bool = False) -> Drive:
    """Make a drive of at most 60 s whose process began 100 s ago."""
    return Drive(
        folder,
        "tcp/localhost:7447",
        "agent",
        Choices(),
        sections={},
        began_s=time.monotonic() - 100.0,
        limit_s=60.0,
        limits_start=limits_start,
        start_s=dict(reached_s),
    )


def test_a_slow_start_takes_nothing_from_a_drive(tmp_path: Path) -> None:
    assert not after_100_s(tmp_path, {FIRST_POSE: 90.0}).is_over_limit()


def test_a_slow_start_counts_in_a_limit_that_the_user_gives(tmp_path: Path) -> None:
    assert after_100_s(tmp_path, {FIRST_POSE: 90.0}, limits_start=True).is_over_limit()


def test_a_drive_that_never_starts_ends_at_its_limit(tmp_path: Path) -> None:
    assert after_100_s(tmp_path, {}).is_over_limit()
