"""Lockstep through real processes, Zenoh and two workers: the same bytes, and no end for a kill."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from msgspec.structs import replace

from cogmap.bus.codec import encode
from cogmap.recording.diff import diff
from cogmap.recording.storage.reader import LogReader
from cogmap.schemas import topics
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


def _deltas(run: Run) -> list[bytes]:
    """The deltas of a drive, but for their numbers, which begin anew with the workspace."""
    reader = LogReader(run.folder / "log.mcap")
    found = []
    for record in reader.records([topics.DELTA]):
        delta = reader.message(record)
        found.append(encode(replace(delta, seq=0)))
    return found


def test_a_kill_of_what_can_be_computed_again_changes_no_byte_of_the_graph(
    start: Callable[..., Run],
) -> None:
    drives = []
    for killed in ((), ("codelets-1",), ("procedural", "action")):
        run = start("--lockstep", "--laps", "0.2", "--set", "sim.sensing=percepts")
        run.wait_for(DRIVING)
        run.kill(*killed)
        assert run.end() == 0, run.output()
        assert run.summary()["restarts"] == dict.fromkeys(killed, 1)
        drives.append(_deltas(run))

    undisturbed, *others = drives
    assert len(undisturbed) > 100
    assert others == [undisturbed, undisturbed]


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
