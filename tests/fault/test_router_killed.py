"""The router dies and comes back: what was published meanwhile arrives, and cycles continue."""

from __future__ import annotations

import signal

from tests.support.system.live import Feeder, Witness
from tests.support.system.processes import System, wait_until


def test_deltas_arrive_in_order_and_cycles_continue_after_a_router_is_killed(
    agent: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = agent
    last = witness.versions[-1]
    enough = feeder.views + 5

    system.processes["router"].end(signal.SIGKILL)
    wait_until(lambda: feeder.views >= enough, "views continue without a router")
    system.router()
    wait_until(lambda: witness.versions[-1] > last, "deltas arrive again")
    witness.await_cycles(5)
    feeder.pause()
    witness.await_same_graph()

    first = witness.versions[0]
    end = first + len(witness.versions)
    assert witness.versions == list(range(first, end))
    assert not witness.shell.notes
    assert not witness.shell.intake.gaps
    assert all(process.is_alive for process in system.processes.values())
