"""Periodic jobs of a shell."""

from __future__ import annotations

import pytest

from cogmap.runtime import timers
from cogmap.runtime.timers import Timers


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    now_ns = [0]
    monkeypatch.setattr(timers.time, "monotonic_ns", lambda: now_ns[0])
    return now_ns


def test_a_job_runs_once_a_period(clock: list[int]) -> None:
    runs: list[int] = []
    jobs = Timers([(100, runs.append)])

    for clock[0] in range(0, 500, 10):
        jobs.run_due()

    assert runs == [100, 200, 300, 400]


def test_a_job_that_comes_late_is_not_made_up_for(clock: list[int]) -> None:
    runs: list[int] = []
    jobs = Timers([(100, runs.append)])

    for clock[0] in (570, 580, 590, 600, 610):
        jobs.run_due()

    assert runs == [570, 600]


def test_the_time_until_the_next_job_is_returned(clock: list[int]) -> None:
    jobs = Timers([(2_000_000_000, lambda now_ns: None), (3_000_000_000, lambda now_ns: None)])
    clock[0] = 500_000_000

    assert jobs.run_due() == 1.5
    assert Timers([]).run_due() is None
