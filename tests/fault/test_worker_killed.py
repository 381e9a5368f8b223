"""A worker dies with a task in hand: another does it, and it is committed once."""

from __future__ import annotations

import signal
from collections import Counter

import pytest

from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from schemas import topics
from schemas.codelets import Assignment, Leases, Proposal
from tests.support.system.live import Feeder, Witness
from tests.support.system.networks import working
from tests.support.system.processes import System, wait_until

PATIENT = ("workspace.deadline_ms=20000", "workspace.lease_ms=20000")
STOPPED = "codelets-1"
OTHER = "codelets-2"
ATTENTION = {"whereabouts", "novelty"}


@pytest.mark.parametrize(
    "agent", [PATIENT], indirect=True, ids=["only its death takes back what it holds"]
)
def test_the_task_of_a_killed_worker_is_done_by_another_and_committed_once(
    agent: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = agent
    leases: list[Assignment] = []
    answers: list[Proposal] = []

    def keep(message: Leases) -> None:
        leases.extend(message.assignments)

    observer = Module("observer").on(topics.LEASES, keep)
    observer.on(topics.PROPOSAL, answers.append)

    with working(Shell(observer, system.bus())):
        wait_until(
            lambda: any(lease.worker == STOPPED for lease in leases), f"{STOPPED} is given tasks"
        )
        system.processes[STOPPED].send(signal.SIGSTOP)
        held = _held(leases, answers)
        cycle = _cycle(held.task_id)

        system.processes[STOPPED].end(signal.SIGKILL)
        wait_until(lambda: _latest_cycle(witness) > cycle, f"cycle {cycle} ends")
        witness.await_cycles(5)
        feeder.pause()
        witness.await_same_graph()

    first, second = (lease for lease in leases if lease.task_id == held.task_id)
    assert (first.worker, first.attempt) == (STOPPED, 0)
    assert (second.worker, second.attempt) == (OTHER, 1)

    # What attention finds is not written into the graph, so no delta names its task.
    _, codelet, *_ = held.task_id.split("/")
    times = Counter(witness.tasks_done)
    assert codelet in ATTENTION or held.task_id in times
    assert max(times.values()) == 1


def _held(leases: list[Assignment], answers: list[Proposal]) -> Assignment:
    """The task that the stopped worker has not answered.

    It is looked for twice, as an answer may be under way.
    """
    open_before: set[str] = set()

    def holds() -> bool:
        nonlocal open_before
        given = {lease.task_id for lease in leases if lease.worker == STOPPED}
        answered = {answer.task_id for answer in answers}
        still_open = given - answered
        both = open_before & still_open
        open_before = still_open
        return bool(both)

    wait_until(holds, f"{STOPPED} holds a task")
    return next(lease for lease in reversed(leases) if lease.task_id in open_before)


def _latest_cycle(witness: Witness) -> int:
    cycles = [_cycle(task_id) for task_id in witness.tasks_done]
    return max(cycles, default=0)


def _cycle(task_id: str) -> int:
    return int(task_id.partition("/")[0])
