"""The workspace dies and is started again with its journal."""

from __future__ import annotations

import signal

import pytest

from cogmap.schemas.graph import Phase
from tests.support.system.live import Feeder, Witness
from tests.support.system.processes import System, wait_until

TOLERANCE_M = 0.3


def believed(witness: Witness) -> tuple[float, int]:
    """The self node's x, and the stamp of the view that it is of."""
    agent = witness.graph.agent
    assert agent is not None
    return agent.x_m, agent.stamp_ns


def test_a_restarted_workspace_resumes_its_graph_and_the_missed_self_motion(
    agent: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = agent
    began_m, began_ns = believed(witness)

    system.processes["workspace"].end(signal.SIGKILL)
    enough = feeder.views + 10
    wait_until(lambda: feeder.views >= enough, "views continue without a workspace")
    deltas_before = len(witness.deltas)
    version = witness.graph.version
    cycle = witness.graph.cycle

    system.modules("workspace")
    witness.await_cycles(5)
    feeder.pause()
    witness.await_same_graph()

    first = witness.deltas[deltas_before]
    versions = witness.versions[deltas_before:]
    assert first.version > version
    ended = [delta for delta in witness.deltas[deltas_before:] if delta.cycle <= cycle]
    assert [(delta.cycle, delta.phase, delta.operations) for delta in ended] in (
        [],
        [(cycle, Phase.END, [])],
    )
    assert versions == list(range(first.version, first.version + len(versions)))

    ended_m, ended_ns = believed(witness)
    driven_m = feeder.driven_m(ended_ns) - feeder.driven_m(began_ns)
    assert ended_m - began_m == pytest.approx(driven_m, abs=TOLERANCE_M)
