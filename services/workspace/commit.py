"""The single writer of the graph: validates proposals, and commits them as numbered deltas."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from cogmap.errors import MessageError
from cogmap.graph import lineage
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import CycleContext
from cogmap.schemas.codelets import Offer, Proposal
from cogmap.schemas.cognition import Coalitions
from cogmap.schemas.graph import Cells, Delta, Links, Operation, Phase, Snapshot
from cogmap.schemas.nodes import KINDS, ROOT_MAP, LinkKind, Map
from cogmap.services.workspace.rules import Key, Writer, check_operation, written_by

# Stated in a delta, so that a worker that fails all the time does not make deltas large.
MAX_REASONS = 8
MAX_REASON_CHARACTERS = 200
REMEMBERED_VERSIONS = 4096
"""It is known what was written when of so many versions, three minutes of a usual drive: an answer
on an older one is late, whatever it writes.
"""


class Ledger:
    """The graph, and the version that last wrote each node and each column of a tile.

    What a snapshot holds counts as written at its version, and what is not known any more as
    written at the last that is not.
    """

    def __init__(self, writers: Mapping[str, Writer]) -> None:
        self.graph = Graph()
        self._writers = writers

        self._rejected = 0
        self._reasons: list[str] = []

        self._written: dict[Key, int] = {}
        self._written_before = 0

    def restore(self, past: Snapshot | Delta) -> None:
        """Restore what was committed before."""
        if isinstance(past, Snapshot):
            self.graph.load(past)
            self.graph.lineage = self.graph.lineage or lineage.FIRST
            self._written.clear()
            self._written_before = past.version
        elif self.graph.apply(past):
            self._note(past)

    def commit(
        self,
        stamp_ns: int,
        cycle: int,
        phase: Phase,
        operations: list[Operation],
        tasks: list[str] | None = None,
    ) -> Delta:
        """Number `operations`, carry them out, and return the delta.

        It has the number of answers rejected since the delta before, and the reasons.
        """
        before = self.graph.lineage if phase is Phase.END else None
        delta = Delta(
            stamp_ns=stamp_ns,
            version=self.graph.version + 1,
            cycle=cycle,
            phase=phase,
            tasks=tasks or [],
            operations=operations,
            rejected=self._rejected,
            reasons=self._reasons,
            lineage=before or msgspec.UNSET,
        )
        self._rejected = 0
        self._reasons = []

        self.graph.apply(delta)
        self._note(delta)
        return delta

    def validate(self, proposals: list[Proposal]) -> list[Proposal]:
        """Return the proposals that are valid, in order; the next delta counts the others.

        Of those that write the same column of a tile the first is valid: the others were computed
        without what it adds.
        """
        valid = []
        written: set[Key] = set()
        for proposal in proposals:
            try:
                columns = self.check(proposal)
                shared = columns & written
                if shared:
                    column = _in_words(min(shared, key=str))
                    raise MessageError(
                        f"proposal {proposal.task_id}: {column} is written by another in this phase"
                    )
            except MessageError as error:
                self.reject(str(error))
            else:
                valid.append(proposal)
                written |= columns

        return valid

    def reject(self, reason: str) -> None:
        """Have the next delta count an answer that is in none, and state the first few reasons."""
        self._rejected += 1
        if len(self._reasons) < MAX_REASONS:
            self._reasons.append(reason[:MAX_REASON_CHARACTERS])

    def check(self, proposal: Proposal) -> set[Key]:
        """Return the columns of tiles that `proposal` writes. Raises MessageError if it is not
        valid, stating why.
        """
        name = f"proposal {proposal.task_id}"
        if proposal.failure:
            raise MessageError(f"{name} failed: {proposal.failure}")

        if proposal.base_version > self.graph.version:
            raise MessageError(
                f"{name} is on version {proposal.base_version}, which is not committed yet"
            )

        writer = self._writers.get(proposal.codelet)
        if writer is None:
            raise MessageError(f"{name}: no codelet {proposal.codelet!r} is configured here")

        columns: set[Key] = set()
        for operation in proposal.operations:
            check_operation(name, operation, self.graph, writer)
            keys = list(written_by(operation))
            self._check_late(name, keys, proposal.base_version)
            self._check_late(name, _frames_of(operation), proposal.base_version)
            if isinstance(operation, Cells):
                columns.update(keys)

        return columns

    def check_offer(self, offer: Offer, writer: Writer) -> None:
        """Raise MessageError if an offer writes what may not be offered."""
        name = f"offer {offer.seq} of {offer.source}"
        for operation in offer.operations:
            check_operation(name, operation, self.graph, writer)

    def _check_late(self, name: str, keys: list[Key], base_version: int) -> None:
        for key in keys:
            version = self._written.get(key, self._written_before)
            if version <= base_version:
                continue

            raise MessageError(f"{name} is late: {_in_words(key)} has changed since {base_version}")

    def _note(self, delta: Delta) -> None:
        written = self._written
        version = delta.version
        for operation in delta.operations:
            if type(operation) in KINDS:
                written[operation.id] = version  # type: ignore[union-attr]
                continue

            for key in written_by(operation):
                written[key] = version

        if version - self._written_before >= 2 * REMEMBERED_VERSIONS:
            self._written_before = version - REMEMBERED_VERSIONS
            self._written = {
                key: known for key, known in written.items() if known > self._written_before
            }


def coalitions_of(context: CycleContext, proposals: list[Proposal]) -> Coalitions:
    """Gather what all attention codelets have found in a cycle, perhaps nothing."""
    found = []
    for proposal in proposals:
        for number, coalition in enumerate(proposal.coalitions):
            name = f"{proposal.task_id}/{number}"
            found.append(msgspec.structs.replace(coalition, id=name))
    return Coalitions(stamp_ns=context.stamp_ns, cycle=context.cycle, coalitions=found)


def _frames_of(operation: Operation) -> list[Key]:
    """Return the maps in whose frames an operation writes: if one has changed, an answer is late.
    Cells of the root map are written as they are.
    """
    if isinstance(operation, Cells) and operation.map != ROOT_MAP:
        return [operation.map]
    if isinstance(operation, Map) and operation.parent:
        return [operation.parent]
    if isinstance(operation, Links) and operation.kind == LinkKind.WITHIN:
        return sorted({target for targets in operation.weights.values() for target in targets})
    return []


def _in_words(key: Key) -> str:
    if isinstance(key, str):
        return key
    return " ".join(map(str, key))
