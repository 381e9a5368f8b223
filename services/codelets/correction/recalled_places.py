"""The place nodes of a recalled map on the root map, whose cells are the same. Pure."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cogmap.graph.window import EVIDENCE_COLUMNS, WEIGHT_COLUMNS
from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import TILE_SIDE, Recollection
from cogmap.services.codelets.cells import written_cells
from cogmap.services.codelets.mapping.evidence import weights_of


def recalled_places(recalled: Recollection) -> Iterator[Operation]:
    """Return what is known of the recalled place nodes, and the weights of their links by the
    evidence.
    """
    weight_of = dict(zip(EVIDENCE_COLUMNS, WEIGHT_COLUMNS, strict=True))
    corners = np.array(recalled.tiles).reshape(-1, 2) * TILE_SIDE
    for column, matrix in recalled.columns.items():
        every = np.asarray(matrix.numpy(), np.float32)
        tile, number = np.nonzero(every)
        i, j = np.divmod(number, TILE_SIDE)
        cells = corners[tile] + np.column_stack([i, j])
        values = every[tile, number]

        yield from written_cells(column, cells, values)
        if column in weight_of:
            yield from written_cells(weight_of[column], cells, weights_of(values))
