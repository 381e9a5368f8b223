"""A worker dies with a task in hand: another does it, and it is committed once."""

from __future__ import annotations

import signal
from collections import Counter

import pytest

from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from schemas import topics
from schemas.cognition import Task
from schemas.graph import Proposal
from tests.support.live import Feeder, System, Witness, wait_until
from tests.support.networks import working

PATIENT = ("workspace.deadline_ms=20000", "workspace.lease_ms=20000")
STOPPED = "codelets-1"
OTHER = "codelets-2"


@pytest.mark.parametrize(
    "mind", [PATIENT], indirect=True, ids=["only its death takes back what it holds"]
)
def test_the_task_of_a_killed_worker_is_done_by_another_and_committed_once(
    mind: tuple[System, Feeder, Witness],
) -> None:
    system, feeder, witness = mind
    tasks: list[Task] = []
    answers: list[Proposal] = []
    looking = Module("looking").on(topics.TASK, tasks.append).on(topics.PROPOSAL, answers.append)
    with working(Shell(looking, system.bus())):
        wait_until(
            lambda: any(task.worker == STOPPED for task in tasks), f"{STOPPED} is given tasks"
        )
        system.processes[STOPPED].send(signal.SIGSTOP)
        held = _held(tasks, answers)
        system.processes[STOPPED].end(signal.SIGKILL)
        wait_until(lambda: _latest_cycle(witness) > held.cycle, f"the cycle of {held.task_id} ends")
        witness.goes_on(5)
        feeder.pause()
        witness.agrees()
    again = [task for task in tasks if task.task_id == held.task_id]
    assert [(task.worker, task.attempt) for task in again] == [(STOPPED, 0), (OTHER, 1)]
    # What attention finds is not written into the graph, so no delta names its task.
    assert held.codelet == "attention" or held.task_id in witness.tasks_done
    assert max(Counter(witness.tasks_done).values()) == 1


def _held(tasks: list[Task], answers: list[Proposal]) -> Task:
    """The task that the stopped worker has not answered: twice in a row, as an answer may be on its
    way.
    """
    open_before: set[str] = set()

    def holds() -> bool:
        nonlocal open_before
        answered = {answer.task_id for answer in answers}
        still_open = {task.task_id for task in tasks if task.worker == STOPPED} - answered
        both = open_before & still_open
        open_before = still_open
        return bool(both)

    wait_until(holds, f"{STOPPED} holds a task")
    return next(task for task in reversed(tasks) if task.task_id in open_before)


def _latest_cycle(witness: Witness) -> int:
    return max((int(name.partition("/")[0]) for name in witness.tasks_done), default=0)
