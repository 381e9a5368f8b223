"""Which worker does which task: leases, taken back when the worker goes or the lease ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import msgspec

from schemas.cognition import Task
from schemas.graph import Proposal


@dataclass
class Lease:
    """A task that a worker holds until `until_ns`; it waits for a worker while `task.worker` is its
    placeholder.

    `lost_by` had it before.
    """

    task: Task
    until_ns: int
    lost_by: str = ""
    proposal: Proposal | None = None


NOBODY = "nobody"
BUSY = 1000


class Dispatch:
    """Gives tasks to the least loaded worker, but not again to the one that lost it where there is
    another.

    The same workers and tasks give the same choice. Whoever is at a task of the dispatch `beside`
    counts as busy.
    """

    def __init__(self, lease_ns: int, attempts: int, beside: Dispatch | None = None) -> None:
        self._lease_ns = lease_ns
        self._attempts = attempts
        self._beside = beside
        self._workers: set[str] = set()
        self._leases: dict[str, Lease] = {}

    def begin(self, tasks: list[Task], now_ns: int) -> list[Task]:
        """Take on `tasks` and return those to be sent now; where there is no worker they wait for
        one.
        """
        for task in tasks:
            self._leases[task.task_id] = Lease(task, now_ns)
        return self._assign(now_ns)

    def presence(self, worker: str, alive: bool, now_ns: int) -> list[Task]:
        """A worker came or went: tasks to send because of it."""
        if alive:
            self._workers.add(worker)
        else:
            self._workers.discard(worker)
            self._take_back(lambda lease: lease.task.worker == worker)
        return self._assign(now_ns)

    def expire(self, now_ns: int) -> list[Task]:
        """Tasks to send to somebody else, since their lease has ended; where there is nobody else,
        they stay.
        """
        self._take_back(
            lambda lease: now_ns > lease.until_ns and not self._workers <= {lease.task.worker}
        )
        return self._assign(now_ns)

    def answer(self, proposal: Proposal) -> bool:
        """Take in a proposal. False where nobody waits for it: it was answered before, or is of
        another time.
        """
        lease = self._leases.get(proposal.task_id)
        if lease is None or lease.proposal is not None:
            return False
        lease.proposal = proposal
        return True

    @property
    def complete(self) -> bool:
        """Whether every task is answered, or given up."""
        return all(
            lease.proposal is not None or self._has_failed(lease) for lease in self._leases.values()
        )

    @property
    def failed(self) -> list[str]:
        """The tasks that are given up: handed out as often as is allowed, and lost each time."""
        return [name for name, lease in self._leases.items() if self._has_failed(lease)]

    def collect(self) -> tuple[list[Proposal], list[Task]]:
        """The answers, in the order of the tasks, and the tasks without one; all are done with now."""
        leases = self._leases
        self._leases = {}
        answers = [lease.proposal for lease in leases.values() if lease.proposal is not None]
        return answers, [lease.task for lease in leases.values() if lease.proposal is None]

    def _has_failed(self, lease: Lease) -> bool:
        return (
            lease.proposal is None
            and lease.task.worker == NOBODY
            and lease.task.attempt >= self._attempts
        )

    def _take_back(self, lost: Callable[[Lease], bool]) -> None:
        for lease in self._leases.values():
            if lease.proposal is None and lease.task.worker != NOBODY and lost(lease):
                lease.lost_by = lease.task.worker
                lease.task = msgspec.structs.replace(
                    lease.task, worker=NOBODY, attempt=lease.task.attempt + 1
                )

    def _load(self) -> Counter[str]:
        return Counter(
            lease.task.worker for lease in self._leases.values() if lease.proposal is None
        )

    def _assign(self, now_ns: int) -> list[Task]:
        load = self._load()
        if self._beside is not None:
            # Who is at something long will be long.
            load.update({worker: BUSY * tasks for worker, tasks in self._beside._load().items()})
        sent = []
        for lease in self._leases.values():
            waits = lease.proposal is None and lease.task.worker == NOBODY
            if not waits or not self._workers or self._has_failed(lease):
                continue
            worker = min(self._workers, key=lambda name: (name == lease.lost_by, load[name], name))
            load[worker] += 1
            lease.task = msgspec.structs.replace(lease.task, worker=worker)
            lease.until_ns = now_ns + self._lease_ns
            sent.append(lease.task)
        return sent
