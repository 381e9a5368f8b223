"""Which worker does which task: leases, revoked when the worker goes or the lease ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import msgspec

from cogmap.errors import MessageError
from cogmap.runtime.notes import note
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Assignment, Leases, Proposal, Task

# More tasks than a phase has.
BUSY = 1000
MAX_ATTEMPTS = 5
"""Workers that a task is given to before it has failed: one that kills each must end."""
REST_NS = 5_000_000_000
"""A worker that kept a task for longer than its lease gets others last for so long."""
TOLD_NS = 3 * REST_NS
"""For so long it is told."""


@dataclass
class Lease:
    """A task, and the worker that holds it until `until_ns`; `worker` is empty while none does.

    `lost_by` is the worker that held it before, `attempt` the number of workers that lost it, and
    `holders` are all to whom it was given: of any of them the first answer counts.
    """

    task: Task
    until_ns: int
    worker: str = ""
    lost_by: str = ""
    attempt: int = 0
    proposal: Proposal | None = None
    holders: set[str] = field(default_factory=set)

    @property
    def is_open(self) -> bool:
        """Return whether no answer has come yet."""
        return self.proposal is None


@dataclass
class _Overdue:
    """How many leases of a worker have ended, and when the last did."""

    leases: int = 0
    at_ns: int = 0

    def is_within(self, time_ns: int, now_ns: int) -> bool:
        """Return whether the last ended that long ago at most: by clocks, which may go back."""
        return 0 <= now_ns - self.at_ns <= time_ns


class Dispatch:
    """Gives each task to the least loaded worker; to one that lost it only if there is no other,
    and to one that has lost another lately only if all have.

    The same workers and tasks give the same choice. Workers that hold a task of one of the
    dispatches in `background` count as busy. A lease lasts `lease_ns`.
    """

    def __init__(self, lease_ns: int, background: Callable[[], list[Dispatch]] = list) -> None:
        self.lease_ns = lease_ns
        self._background = background
        self._workers: set[str] = set()
        self._leases: dict[str, Lease] = {}
        self._overdue: dict[str, _Overdue] = {}

    def begin(self, tasks: list[Task], now_ns: int) -> list[Message]:
        """Add `tasks`; return what is to be published now. Without a worker they wait for one."""
        for task in tasks:
            self._leases[task.task_id] = Lease(task, now_ns)

        return self._assign(now_ns)

    def presence(self, worker: str, alive: bool, now_ns: int) -> list[Message]:
        """Note that a worker came or went; return what is to be published because of it."""
        if alive:
            self._workers.add(worker)
        else:
            self._workers.discard(worker)
            self._overdue.pop(worker, None)
            self._revoke(lambda lease: lease.worker == worker)

        return self._assign(now_ns)

    def expire(self, now_ns: int) -> list[Message]:
        """Give tasks whose lease has ended to another worker; they stay if there is no other. A
        lease ends at most as long from now as one that begins.
        """

        def has_ended(lease: Lease) -> bool:
            lease.until_ns = min(lease.until_ns, now_ns + self.lease_ns)
            if now_ns <= lease.until_ns:
                return False
            others = self._workers - {lease.worker}
            return bool(others)

        def is_lost(lease: Lease) -> bool:
            if not has_ended(lease):
                return False
            self._note_overdue(lease.worker, now_ns)
            return True

        self._revoke(is_lost)
        return self._assign(now_ns)

    def repeat(self, now_ns: int) -> list[Message]:
        """Give every open task once more, to another worker if there is one: whoever held it may
        never have received it. It counts as no attempt, since the worker may only be slow.
        """
        for lease in self._leases.values():
            if lease.is_open and lease.worker:
                lease.lost_by = lease.worker
                lease.worker = ""

        return self._assign(now_ns)

    def refresh(self, version: int) -> None:
        """Have open tasks without a worker read the graph at `version`."""
        for lease in self._leases.values():
            is_waiting = lease.is_open and not lease.worker
            if is_waiting:
                lease.task = msgspec.structs.replace(lease.task, version=version)

    def answer(self, proposal: Proposal) -> bool:
        """Take a proposal.

        False if none is expected: the task was answered before, or is of another time. Raises
        MessageError if the task was never given to who answers it.
        """
        lease = self._leases.get(proposal.task_id)
        if lease is None or not lease.is_open:
            return False

        check_holder(proposal, lease.holders)
        lease.proposal = proposal
        return True

    @property
    def is_idle(self) -> bool:
        """Return whether it has no tasks at all."""
        return not self._leases

    @property
    def complete(self) -> bool:
        """Return whether every task is answered, or has failed."""
        for lease in self._leases.values():
            if lease.is_open and not self._has_failed(lease):
                return False

        return True

    @property
    def failed(self) -> list[str]:
        """Return the tasks that were given out as often as is allowed, and lost each time."""
        names = []
        for name, lease in self._leases.items():
            if self._has_failed(lease):
                names.append(name)

        return names

    def collect(self) -> tuple[list[Proposal], list[Lease]]:
        """Take out the answers, in the order of the tasks, and the leases of those without one."""
        answers = []
        unanswered = []
        for lease in self._leases.values():
            if lease.proposal is None:
                unanswered.append(lease)
            else:
                answers.append(lease.proposal)

        self._leases = {}
        return answers, unanswered

    def load(self) -> Counter[str]:
        """Count the open tasks that each worker holds."""
        return Counter(lease.worker for lease in self.held())

    def held(self) -> list[Lease]:
        """Return the open tasks that workers hold."""
        return [lease for lease in self._leases.values() if lease.is_open and lease.worker]

    def notes(self, now_ns: int) -> list[str]:
        """Say which workers are slow."""
        notes = []
        for worker, overdue in sorted(self._overdue.items()):
            if overdue.is_within(TOLD_NS, now_ns):
                wrong = (
                    f"{worker} kept {overdue.leases} tasks for longer than their leases, and gets "
                    f"others last"
                )
                notes.append(note(wrong, f"end other programs where it runs, or end {worker}"))
        return notes

    def _note_overdue(self, worker: str, now_ns: int) -> None:
        overdue = self._overdue.setdefault(worker, _Overdue())
        if not overdue.is_within(TOLD_NS, now_ns):
            overdue.leases = 0
        overdue.leases += 1
        overdue.at_ns = now_ns

    def _rests(self, worker: str, now_ns: int) -> bool:
        overdue = self._overdue.get(worker)
        return overdue is not None and overdue.is_within(REST_NS, now_ns)

    def _has_failed(self, lease: Lease) -> bool:
        is_waiting = lease.is_open and not lease.worker
        return is_waiting and lease.attempt >= MAX_ATTEMPTS

    def _revoke(self, is_lost: Callable[[Lease], bool]) -> None:
        for lease in self._leases.values():
            is_held = lease.is_open and bool(lease.worker)
            if is_held and is_lost(lease):
                lease.lost_by = lease.worker
                lease.worker = ""
                lease.attempt += 1

    def _assign(self, now_ns: int) -> list[Message]:
        """Assign open tasks: one message of all leases, then each task, so that a worker begins
        with the first while the others are on their way.
        """
        if not self._workers:
            return []

        # A background task counts as BUSY others: the youngest once, each older one once more, for
        # it may well take longer.
        load = self.load()
        held = [lease for other in self._background() for lease in other.held()]
        held.sort(key=lambda lease: -lease.task.cycle)
        for rank, lease in enumerate(held, start=1):
            load[lease.worker] += BUSY * rank

        resting = {worker for worker in self._workers if self._rests(worker, now_ns)}
        tasks: list[Task] = []
        assignments: list[Assignment] = []
        for lease in self._leases.values():
            is_waiting = lease.is_open and not lease.worker
            if not is_waiting or self._has_failed(lease):
                continue

            lost_by = lease.lost_by
            worker = min(
                self._workers,
                key=lambda name: (name == lost_by, name in resting, load[name], name),
            )
            load[worker] += 1
            lease.worker = worker
            lease.holders.add(worker)
            lease.until_ns = now_ns + self.lease_ns
            tasks.append(lease.task)
            assignment = Assignment(
                task_id=lease.task.task_id,
                worker=worker,
                attempt=lease.attempt,
                version=lease.task.version,
            )
            assignments.append(assignment)

        if not tasks:
            return []
        stamp_ns = max(task.stamp_ns for task in tasks)
        return [Leases(stamp_ns=stamp_ns, assignments=assignments), *tasks]


def check_holder(proposal: Proposal, holders: set[str]) -> None:
    """Raise MessageError if the task was never given to who answers it."""
    if proposal.source not in holders:
        raise MessageError(
            f"an answer of {proposal.source!r} to {proposal.task_id}, which was given to "
            f"{', '.join(sorted(holders)) or 'nobody yet'}"
        )
