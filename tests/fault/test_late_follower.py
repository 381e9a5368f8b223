"""Somebody begins to follow the graph of an agent that has been running for a while."""

from __future__ import annotations

import signal

from tests.support.system.live import Feeder, Witness
from tests.support.system.networks import working
from tests.support.system.processes import System, wait_until


def test_a_late_follower_has_the_graph_though_the_workspace_dies_as_it_joins(
    agent: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = agent
    workspace = system.processes["workspace"]
    late = Witness(system.bus(), "late")

    workspace.send(signal.SIGSTOP)
    workspace.end(signal.SIGKILL)
    with working(late.shell):
        assert late.graph.version == 0
        system.modules("workspace")
        late.await_cycles(5)
        feeder.pause()
        witness.await_same_graph()
        late.await_same_graph()

    first = late.versions[0]
    end = first + len(late.versions)
    assert first > 1
    assert late.versions == list(range(first, end))
    assert not late.shell.intake.gaps


def test_a_follower_that_joins_begins_with_a_snapshot(
    agent: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = agent
    late = Witness(system.bus(), "late")
    version = witness.graph.version

    with working(late.shell):
        assert late.graph.version >= version
        wait_until(lambda: len(late.deltas) > 0, "deltas arrive")
        late.await_cycles(2)
        feeder.pause()
        late.await_same_graph()

    assert late.versions[0] > version
    assert not late.shell.notes
