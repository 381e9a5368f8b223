"""The tasks of earlier cycles whose answers are still accepted."""

from __future__ import annotations

from collections.abc import Iterable

from cogmap.schemas.codelets import Proposal
from cogmap.services.workspace.tasks.dispatch import Lease, check_holder

MAX_LATE_TASKS = 256
"""A bound, as some are never answered."""


class LateTasks:
    """Tasks that had no answer when their cycle ended, the newest MAX_LATE_TASKS."""

    def __init__(self) -> None:
        self._holders: dict[str, set[str]] = {}

    def put(self, unanswered: Iterable[Lease]) -> None:
        """Accept answers to these from now on."""
        for lease in unanswered:
            self._holders[lease.task.task_id] = lease.holders
        while len(self._holders) > MAX_LATE_TASKS:
            del self._holders[next(iter(self._holders))]

    def answer(self, proposal: Proposal) -> bool:
        """Take an answer. Returns whether its task was waiting for one; it no longer is.

        Raises MessageError if the task was never given to who answers it.
        """
        holders = self._holders.get(proposal.task_id)
        if holders is None:
            return False

        check_holder(proposal, holders)
        del self._holders[proposal.task_id]
        return True
