"""Place nodes as operations on the graph."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Indices, Singles
from cogmap.graph.window import Window
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Cells, Operation
from cogmap.schemas.nodes import ROOT_MAP, PlaceColumn

# The workspace takes no more at once.
MAX_CELLS = 2**16


def written_cells(
    column: PlaceColumn, cells: Indices, values: npt.ArrayLike
) -> Iterator[Operation]:
    """Yield the operations that write (k,) values in (k, 2) cells of a column of the root map."""
    new = np.asarray(values, np.float32)
    for start in range(0, len(cells), MAX_CELLS):
        some = slice(start, start + MAX_CELLS)
        yield Cells(
            map=ROOT_MAP,
            column=column,
            cells=Array.of(cells[some], "<i4"),
            values=Array.of(new[some]),
        )


def changed_cells(map_id: str, known: Window, after: Singles) -> list[Operation]:
    """Return the operations that write those cells of a map whose value in one of the columns of
    `known` differs in (k, w, h) `after`; none for a column that does not change.
    """
    column, i, j = np.nonzero(after != known.values)
    values = after[column, i, j]
    cells = np.column_stack([i, j]) + known.origin
    starts = np.searchsorted(column, np.arange(len(known.columns) + 1)).tolist()

    operations: list[Operation] = []
    for number, name in enumerate(known.columns):
        of_column = slice(starts[number], starts[number + 1])
        if len(values[of_column]):
            changed = Cells(
                map=map_id,
                column=name,
                cells=Array.of(cells[of_column], "<i4"),
                values=Array.of(values[of_column], "<f4"),
            )
            operations.append(changed)

    return operations
