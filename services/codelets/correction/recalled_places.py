"""The place nodes of a recalled map on the root map, whose cells are the same. Pure."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cogmap.geometry.arrays import Indices, Singles
from cogmap.graph.window import EVIDENCE_COLUMNS, WEIGHT_COLUMNS
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Cells, Operation
from cogmap.schemas.nodes import ROOT_MAP, TILE_SIDE, PlaceColumn, Recollection
from cogmap.services.codelets.mapping.evidence import weights_of

MAX_CELLS = 2**16


def recalled_places(recalled: Recollection) -> Iterator[Operation]:
    """What is known of the recalled place nodes, and the weights of their links by the evidence."""
    weight_of = dict(zip(EVIDENCE_COLUMNS, WEIGHT_COLUMNS, strict=True))
    for column, matrix in recalled.columns.items():
        cells, values = _known(recalled, np.asarray(matrix.numpy(), np.float32))
        yield from _written(column, cells, values)
        if column in weight_of:
            yield from _written(weight_of[column], cells, weights_of(values))


def _known(recalled: Recollection, values: Singles) -> tuple[Indices, Singles]:
    """The cells (k, 2) of (n, TILE_CELLS) values that are not 0, and the values, (k,)."""
    tile, number = np.nonzero(values)
    corners = np.array(recalled.tiles).reshape(-1, 2) * TILE_SIDE
    i, j = np.divmod(number, TILE_SIDE)
    return corners[tile] + np.column_stack([i, j]), values[tile, number]


def _written(column: PlaceColumn, cells: Indices, values: Singles) -> Iterator[Operation]:
    """New values of a column, at most as many at once as the workspace takes."""
    for start in range(0, len(cells), MAX_CELLS):
        some = slice(start, start + MAX_CELLS)
        yield Cells(
            map=ROOT_MAP,
            column=column,
            cells=Array.of(cells[some], "<i4"),
            values=Array.of(values[some], "<f4"),
        )
