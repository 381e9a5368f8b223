"""The time limit of a drive."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from cogmap.cli.launch.drive import FIRST_POSE, Drive
from cogmap.cli.launch.plan import Choices


@pytest.mark.parametrize(("limits_start", "is_over"), [(False, False), (True, True)])
def test_a_slow_start_takes_nothing_from_a_drive_unless_the_limit_is_the_users(
    tmp_path: Path, limits_start: bool, is_over: bool
) -> None:
    drive = Drive(
        tmp_path,
        "tcp/localhost:7447",
        "agent",
        Choices(),
        sections={},
        began_s=time.monotonic() - 100.0,
        limit_s=60.0,
        limits_start=limits_start,
        start_s={FIRST_POSE: 90.0},
    )

    assert drive.is_over_limit() is is_over


def test_a_drive_that_never_starts_ends_at_its_limit(tmp_path: Path) -> None:
    drive = Drive(
        tmp_path,
        "tcp/localhost:7447",
        "agent",
        Choices(),
        sections={},
        began_s=time.monotonic() - 100.0,
        limit_s=60.0,
        limits_start=False,
    )

    assert drive.is_over_limit()
