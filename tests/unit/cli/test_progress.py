"""How far work is, and how long it will take."""

from __future__ import annotations

import sys

import pytest

from cogmap.cli import progress
from cogmap.cli.progress import Pace, bar
from tests.support.system.processes import wait_until


def test_the_time_left_follows_from_the_share_done() -> None:
    pace = Pace("exploring", now_s=100.0)
    pace.reach(0.25, now_s=120.0)

    assert pace.line(now_s=120.0) == "exploring: 25%, 60 s left"


def test_of_what_nothing_is_done_the_time_so_far_is_said() -> None:
    assert Pace("reading", now_s=100.0).line(now_s=130.0) == "reading: 30 s so far"


def test_long_times_are_in_minutes() -> None:
    pace = Pace("exploring", now_s=0.0)
    pace.reach(0.1, now_s=60.0)

    assert pace.line(now_s=60.0) == "exploring: 10%, 9 min left"


def test_work_that_begins_anew_is_another_round_with_a_time_of_its_own() -> None:
    pace = Pace("fitting", now_s=0.0)
    pace.reach(1.0, now_s=1000.0)

    assert pace.reach(0.0, now_s=1000.0)
    assert not pace.reach(0.5, now_s=1010.0)
    assert pace.line(now_s=1010.0) == "fitting, round 2: 50%, 10 s left"


def test_the_time_left_runs_down_between_two_steps() -> None:
    pace = Pace("driving", now_s=0.0)
    pace.reach(0.5, now_s=60.0)

    assert pace.line(now_s=100.0) == "driving: 50%, 20 s left"
    assert pace.line(now_s=130.0) == "driving: 50%, 2 min so far"


def test_a_log_has_lines_though_nothing_is_said_to_be_done(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "LINE_EVERY_S", 0.001)
    said: list[str] = []

    def is_said() -> bool:
        said.append(capsys.readouterr().err)
        return bool(said[-1])

    with bar("exploring"):
        wait_until(is_said, "a line is written")

    assert said[-1].startswith("exploring: 0 s so far\n")


def test_what_is_soon_done_says_nothing_in_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    with bar("exploring") as show:
        show(0.25)

    assert capsys.readouterr().err == ""


def test_what_is_soon_done_says_nothing_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)

    with bar("exploring") as show:
        show(0.25)
        show(0.125)

    assert capsys.readouterr().err == ""
