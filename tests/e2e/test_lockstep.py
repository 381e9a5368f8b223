"""Lockstep through real processes, Zenoh and two workers: the same bytes, and no end for a kill."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from cogmap.recording.diff import diff
from tests.support.system.runs import DRIVING, Run

SHORT = ("--lockstep", "--laps", "0.04", "--seed", "6", "--codelets", "2")


def test_two_lockstep_drives_of_one_seed_publish_the_same_bytes(
    start: Callable[..., Run],
) -> None:
    logs = []
    for _ in range(2):
        run = start(*SHORT)
        assert run.end() == 0, run.output()
        assert run.summary()["gaps_total"] == 0
        logs.append(run.folder / "log.mcap")

    compared = diff(*logs)
    counts = {topic.topic: topic.same for topic in compared.topics}
    assert compared.same, compared.first
    assert counts["motor/command"] == counts["epam/percepts"]
    assert counts["motor/command"] > 10


@pytest.mark.parametrize(
    "killed",
    [
        ("epam",),
        ("workspace",),
        ("global_workspace",),
        ("memory",),
        ("codelets-1", "motor"),
        ("procedural", "action"),
    ],
)
def test_the_agent_reaches_its_goals_in_lockstep_though_processes_are_killed(
    killed: tuple[str, ...], start: Callable[..., Run]
) -> None:
    run = start("--lockstep", "--laps", "0.2")
    run.wait_for(DRIVING)

    run.kill(*killed)

    assert run.end() == 0, run.output()
    summary = run.summary()
    assert "every goal" in summary["reason"]
    assert summary["restarts"] == dict.fromkeys(killed, 1)
