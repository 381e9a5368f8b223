"""A worker dies with a task in hand: another does it, and it is committed once."""

from __future__ import annotations

import signal
from collections import Counter

import pytest

from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.codelets import Assignment, Leases, Proposal
from tests.support.system.live import Feeder, Witness
from tests.support.system.networks import working
from tests.support.system.processes import System, wait_until

PATIENT = ("workspace.deadline_ms=20000", "workspace.lease_ms=20000")
VIEWS_UNDER_WAY = 5
STOPPED = "codelets-1"
OTHER = "codelets-2"
ATTENTION = {"whereabouts", "novelty"}


class Observer:
    """Keeps which worker was given which task, and what was answered."""

    def __init__(self) -> None:
        self.leases: list[Assignment] = []
        self.answers: list[Proposal] = []
        self.module = Module("observer")
        self.module.on(topics.LEASES, self._on_leases)
        self.module.on(topics.PROPOSAL, self.answers.append)

    def await_lease(self, worker: str) -> None:
        """Wait until `worker` has been given a task."""

        def is_given() -> bool:
            return any(lease.worker == worker for lease in self.leases)

        wait_until(is_given, f"{worker} is given tasks")

    def held_by(self, worker: str, feeder: Feeder) -> Assignment:
        """A task that a stopped worker has not answered.

        It stays unanswered for some views, as an answer may be under way when it is stopped.
        """
        held: set[str] = set()
        while not held:
            before = self._unanswered(worker)
            enough = feeder.views + VIEWS_UNDER_WAY
            wait_until(lambda: feeder.views >= enough, "views continue")  # noqa: B023
            held = before & self._unanswered(worker)
        return next(lease for lease in reversed(self.leases) if lease.task_id in held)

    def _unanswered(self, worker: str) -> set[str]:
        given = {lease.task_id for lease in self.leases if lease.worker == worker}
        answered = {answer.task_id for answer in self.answers}
        return given - answered

    def _on_leases(self, message: Leases) -> None:
        self.leases.extend(message.assignments)


@pytest.mark.parametrize(
    "agent", [PATIENT], indirect=True, ids=["only its death takes back what it holds"]
)
def test_the_task_of_a_killed_worker_is_done_by_another_and_committed_once(
    agent: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = agent
    observer = Observer()

    with working(Shell(observer.module, system.bus())):
        observer.await_lease(STOPPED)
        system.processes[STOPPED].send(signal.SIGSTOP)
        held = observer.held_by(STOPPED, feeder)
        cycle = _cycle(held.task_id)

        system.processes[STOPPED].end(signal.SIGKILL)
        wait_until(lambda: _latest_cycle(witness) > cycle, f"cycle {cycle} ends")
        witness.await_cycles(5)
        feeder.pause()
        witness.await_same_graph()

    first, second = (lease for lease in observer.leases if lease.task_id == held.task_id)
    assert (first.worker, first.attempt) == (STOPPED, 0)
    assert (second.worker, second.attempt) == (OTHER, 1)

    # What attention finds is not written into the graph, so no delta names its task.
    _, codelet, *_ = held.task_id.split("/")
    times = Counter(witness.tasks_done)
    assert codelet in ATTENTION or held.task_id in times
    assert max(times.values()) == 1


def _latest_cycle(witness: Witness) -> int:
    cycles = [_cycle(task_id) for task_id in witness.tasks_done]
    return max(cycles, default=0)


def _cycle(task_id: str) -> int:
    return int(task_id.partition("/")[0])
