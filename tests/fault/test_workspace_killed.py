"""The workspace dies and is started again with its journal."""

from __future__ import annotations

import signal

import pytest

from tests.support.live import Feeder, System, Witness, wait_until


def where(witness: Witness) -> tuple[float, int]:
    """The self node's x and the view that it is of."""
    agent = witness.graph.agent
    assert agent is not None
    return agent.x_m, agent.stamp_ns


def test_a_restarted_workspace_resumes_its_graph_and_the_missed_self_motion(
    mind: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = mind
    began_m, began_ns = where(witness)
    system.processes["workspace"].end(signal.SIGKILL)
    views = feeder.views
    wait_until(lambda: feeder.views >= views + 10, "views go on without a workspace")
    seen = len(witness.deltas)
    version = witness.graph.version
    cycle = witness.graph.cycle
    system.modules("workspace")
    witness.goes_on(5)
    feeder.pause()
    witness.agrees()
    assert witness.deltas[seen].version > version
    assert witness.deltas[seen].cycle > cycle
    versions = witness.versions[seen:]
    assert versions == list(range(versions[0], versions[0] + len(versions)))
    ended_m, ended_ns = where(witness)
    assert ended_m - began_m == pytest.approx(
        feeder.driven_m(ended_ns) - feeder.driven_m(began_ns), abs=0.3
    )
