"""The single writer of the graph: judges proposals, orders them, and commits them as numbered
deltas.
"""

from __future__ import annotations

import numpy as np

from cogmap.errors import MessageError
from cogmap.graph.graph import COLUMNS, TILE_SIDE, Graph, place_cell
from schemas.graph import (
    Cells,
    Delta,
    DropLink,
    DropNode,
    Link,
    Links,
    Node,
    Operation,
    Proposal,
    Snapshot,
)

MAX_SAMPLES = 100_000
MAX_CELLS = 2**16
MAX_TILES = 1024
FARTHEST_CELL = 2**20
TOLD = 8
TOLD_CHARACTERS = 200
WRITABLE = (Node, Link, Links, DropLink, Cells, DropNode)
SELF = "self"
# The rows of the path and of its correction tell more than samples of a position do. Those of the
# self may hold besides its pose what its senses are off by.
COLUMNS_OF = {"path": (9,), "correction": (7,), "sighted": (6,), "self": (3, 7)}
NUMBERS_OF = {"path": ("number",), "sighted": ("number",), "closure": ("from_ns", "to_ns")}
POSE = ("x_m", "y_m", "heading_rad", "stamp_ns")


def written(operation: Operation) -> str | None:
    """The node that an operation rewrites; None for links and for place nodes, which many may
    write.
    """
    return operation.id if isinstance(operation, (Node, DropNode)) else None


class Ledger:
    """The graph, and which version last wrote each of its nodes."""

    def __init__(self, cell_m: float) -> None:
        self.graph = Graph(cell_m)
        self._dropped = 0
        self._refused: list[str] = []
        self._written: dict[str, int] = {}

    def restore(self, past: Snapshot | Delta) -> None:
        """Take up what was committed before."""
        if isinstance(past, Snapshot):
            self.graph.load(past)
        elif self.graph.apply(past):
            self._note(past)

    def commit(
        self,
        stamp_ns: int,
        cycle: int,
        phase: str,
        operations: list[Operation],
        tasks: list[str] | None = None,
    ) -> Delta:
        """Number `operations`, carry them out, and return the delta; it tells how many answers were
        dropped, why.
        """
        dropped = self._dropped
        self._dropped = 0
        refused = self._refused
        self._refused = []
        delta = Delta(
            stamp_ns=stamp_ns,
            version=self.graph.version + 1,
            cycle=cycle,
            phase=phase,
            tasks=tasks or [],
            operations=operations,
            dropped=dropped,
            refused=refused,
        )
        self.graph.apply(delta)
        self._note(delta)
        return delta

    def judge(self, proposals: list[Proposal]) -> tuple[list[Operation], list[str]]:
        """Operations and task ids of the proposals that hold, in order; the next delta tells of
        those that do not.
        """
        operations: list[Operation] = []
        tasks: list[str] = []
        for proposal in proposals:
            try:
                self.check(proposal)
            except MessageError as error:
                self.drop(str(error))
            else:
                operations.extend(proposal.operations)
                tasks.append(proposal.task_id)
        return operations, tasks

    def drop(self, reason: str) -> None:
        """Have the next delta count an answer that is in none, and say why if it is one of the
        first.
        """
        self._dropped += 1
        if len(self._refused) < TOLD:
            self._refused.append(reason[:TOLD_CHARACTERS])

    def check(self, proposal: Proposal) -> None:
        """Raise MessageError where `proposal` does not hold, saying why."""
        name = f"proposal {proposal.task_id}"
        if proposal.failure:
            raise MessageError(f"{name} failed: {proposal.failure}")
        if proposal.base_version > self.graph.version:
            raise MessageError(
                f"{name} is on version {proposal.base_version}, which is not committed yet"
            )
        for operation in proposal.operations:
            if not isinstance(operation, WRITABLE):
                raise MessageError(f"{name}: codelets do not write {type(operation).__name__}")
            node = written(operation)
            if node is not None and self._written.get(node, 0) > proposal.base_version:
                raise MessageError(
                    f"{name} is late: {node} has changed since version {proposal.base_version}"
                )
            self._check_shape(name, operation)
            _check_self(name, operation)
            _check_way(name, operation)

    def _check_shape(self, name: str, operation: Operation) -> None:
        if isinstance(operation, Node) and operation.samples is not None:
            shape = operation.samples.shape
            columns = COLUMNS_OF.get(operation.kind, (2, 3))
            if len(shape) != 2 or not 1 <= shape[0] <= MAX_SAMPLES or shape[1] not in columns:
                raise MessageError(f"{name}: {operation.id} with samples of shape {shape}")
        if isinstance(operation, Node | DropNode) and place_cell(operation.id) is not None:
            raise MessageError(f"{name}: place nodes are written as cells")
        if isinstance(operation, Cells):
            _check_cells(name, operation)

    def _note(self, delta: Delta) -> None:
        for operation in delta.operations:
            if isinstance(operation, (Node, DropNode)):
                self._written[operation.id] = delta.version


def _check_cells(name: str, operation: Cells) -> None:
    """Place nodes come into being by the tile, so their number and how far they lie apart are
    bounded.
    """
    cells = operation.cells
    values = operation.values
    number = len(cells.shape) and cells.shape[0]
    if (cells.shape, cells.dtype) != ((number, 2), "<i4") or (values.shape, values.dtype) != (
        (number,),
        "<f4",
    ):
        raise MessageError(
            f"{name}: cells of shape {cells.shape} with {values.shape} values, or of another dtype"
        )
    if operation.column not in COLUMNS:
        raise MessageError(f"{name}: place nodes have no column {operation.column!r}")
    if number > MAX_CELLS:
        raise MessageError(f"{name}: {number} cells, at most {MAX_CELLS} are taken at once")
    where = np.asarray(cells.numpy(), np.int64)
    if number and np.abs(where).max() > FARTHEST_CELL:
        raise MessageError(
            f"{name}: a cell {np.abs(where).max()} cells away, the farthest is {FARTHEST_CELL}"
        )
    if number > MAX_TILES and (tiles := len(np.unique(where // TILE_SIDE, axis=0))) > MAX_TILES:
        raise MessageError(f"{name}: cells in {tiles} tiles, at most {MAX_TILES} are taken at once")


def _check_self(name: str, operation: Operation) -> None:
    """The self node stays, with samples of its pose and the numbers that everybody reads."""
    if isinstance(operation, DropNode) and operation.id == SELF:
        raise MessageError(f"{name}: the self node is never forgotten")
    if isinstance(operation, Node) and operation.id == SELF:
        lacking = [key for key in POSE if type(operation.attributes.get(key)) not in {int, float}]
        if lacking or operation.samples is None or operation.samples.shape[1] < 3:
            raise MessageError(
                f"{name}: self without {', '.join(lacking) or 'samples of its pose'}"
            )


def _check_way(name: str, operation: Operation) -> None:
    """Nodes of the agent's way have the rows and the numbers that the workspace itself reads."""
    if not isinstance(operation, Node):
        return
    lacking = [
        key
        for key in NUMBERS_OF.get(operation.kind, ())
        if type(operation.attributes.get(key)) is not int
    ]
    if operation.kind in COLUMNS_OF and operation.samples is None:
        lacking.append("samples")
    if lacking:
        raise MessageError(f"{name}: {operation.id} without {', '.join(lacking)}")
