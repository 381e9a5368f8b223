"""The single writer of the graph: judges proposals, orders them, and commits them as numbered deltas."""

from __future__ import annotations

from bus.errors import MessageError
from bus.graph import COLUMNS, Graph, place_cell
from schemas.graph import Cells, Delta, DropLink, DropNode, Link, Links, Node, Operation, Proposal, Snapshot

MAX_SAMPLES = 100_000
WRITABLE = (Node, Link, Links, DropLink, Cells, DropNode)
SELF = "self"
POSE = ("x_m", "y_m", "heading_rad", "stamp_ns")


def written(operation: Operation) -> str | None:
    """The node that an operation rewrites; None for links and for place nodes, which many may write."""
    return operation.id if isinstance(operation, (Node, DropNode)) else None


class Ledger:
    """The graph, and which version last wrote each of its nodes."""

    def __init__(self, cell_m: float) -> None:
        self.graph = Graph(cell_m)
        self.dropped = 0
        self._written: dict[str, int] = {}

    def restore(self, past: Snapshot | Delta) -> None:
        """Take up what was committed before."""
        if isinstance(past, Snapshot):
            self.graph.load(past)
        elif self.graph.apply(past):
            self._note(past)

    def commit(
        self, stamp_ns: int, cycle: int, phase: str, operations: list[Operation], tasks: list[str] | None = None
    ) -> Delta:
        """Number `operations`, carry them out, and return the delta; it tells how many proposals were dropped."""
        dropped, self.dropped = self.dropped, 0
        delta = Delta(
            stamp_ns=stamp_ns,
            version=self.graph.version + 1,
            cycle=cycle,
            phase=phase,
            tasks=tasks or [],
            operations=operations,
            dropped=dropped,
        )
        self.graph.apply(delta)
        self._note(delta)
        return delta

    def judge(self, proposals: list[Proposal]) -> tuple[list[Operation], list[str]]:
        """Operations and task ids of the proposals that hold, in order; the next delta counts those that do not."""
        operations: list[Operation] = []
        tasks: list[str] = []
        for proposal in proposals:
            try:
                self.check(proposal)
            except MessageError:
                self.dropped += 1
            else:
                operations.extend(proposal.operations)
                tasks.append(proposal.task_id)
        return operations, tasks

    def check(self, proposal: Proposal) -> None:
        """Raise MessageError where `proposal` does not hold, saying why."""
        name = f"proposal {proposal.task_id}"
        if proposal.failure:
            raise MessageError(f"{name} failed: {proposal.failure}")
        if proposal.base_version > self.graph.version:
            raise MessageError(f"{name} is on version {proposal.base_version}, which is not committed yet")
        for operation in proposal.operations:
            if not isinstance(operation, WRITABLE):
                raise MessageError(f"{name}: codelets do not write {type(operation).__name__}")
            node = written(operation)
            if node is not None and self._written.get(node, 0) > proposal.base_version:
                raise MessageError(f"{name} is late: {node} has changed since version {proposal.base_version}")
            self._check_shape(name, operation)
            _check_self(name, operation)

    def _check_shape(self, name: str, operation: Operation) -> None:
        if isinstance(operation, Node) and operation.samples is not None:
            shape = operation.samples.shape
            if len(shape) != 2 or not 1 <= shape[0] <= MAX_SAMPLES or shape[1] not in {2, 3}:
                raise MessageError(f"{name}: {operation.id} with samples of shape {shape}")
        if isinstance(operation, Node | DropNode) and place_cell(operation.id) is not None:
            raise MessageError(f"{name}: place nodes are written as cells")
        if isinstance(operation, Cells):
            number = operation.values.shape
            if operation.cells.shape != (*number, 2) or operation.cells.dtype != "<i4":
                raise MessageError(f"{name}: cells of shape {operation.cells.shape} with {number} values")
            if operation.column not in COLUMNS:
                raise MessageError(f"{name}: place nodes have no column {operation.column!r}")

    def _note(self, delta: Delta) -> None:
        for operation in delta.operations:
            node = written(operation)
            if node is not None:
                self._written[node] = delta.version


def _check_self(name: str, operation: Operation) -> None:
    """The self node stays, with samples of its pose and the numbers that everybody reads."""
    if isinstance(operation, DropNode) and operation.id == SELF:
        raise MessageError(f"{name}: the self node is never forgotten")
    if isinstance(operation, Node) and operation.id == SELF:
        lacking = [key for key in POSE if type(operation.attributes.get(key)) not in {int, float}]
        if lacking or operation.samples is None or operation.samples.shape[1] != 3:
            raise MessageError(f"{name}: self without {', '.join(lacking) or 'samples of its pose'}")
