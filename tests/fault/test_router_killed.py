"""The router dies and comes back: what was said meanwhile arrives, and the mind goes on."""

from __future__ import annotations

import signal

from tests.support.live import Feeder, System, Witness, wait_until


def test_deltas_arrive_in_order_and_cycles_continue_after_a_router_is_killed(
    mind: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = mind
    last = witness.versions[-1]
    views = feeder.views
    system.processes["router"].end(signal.SIGKILL)
    wait_until(lambda: feeder.views >= views + 5, "views go on without a router")
    system.router()
    wait_until(lambda: witness.versions[-1] > last, "deltas arrive again")
    witness.goes_on(5)
    feeder.pause()
    witness.agrees()
    first = witness.versions[0]
    assert witness.versions == list(range(first, first + len(witness.versions)))
    assert not witness.shell.notes
    assert not witness.shell.intake.gaps
    assert all(process.is_alive for process in system.processes.values())
