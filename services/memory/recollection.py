"""A recalled map as a node of the Workspace. Pure."""

from __future__ import annotations

import numpy as np

from cogmap.schemas.array import Matrix
from cogmap.schemas.nodes import RECOLLECTION_ID, TILE_CELLS, Recollection
from cogmap.services.memory.recall import Recalled
from cogmap.services.memory.storing import COLUMNS


def recollection(found: Recalled) -> Recollection:
    """Make the node as which a recalled map is offered."""
    remembered = found.remembered
    assert remembered.known is not None
    x_m, y_m, heading_rad = found.pose.tolist()

    # A row for each tile; columns that no tile has are left out.
    columns = {}
    for column in COLUMNS:
        rows = []
        for position in sorted(remembered.tiles):
            values = remembered.tiles[position].get(column)
            rows.append(np.zeros((1, TILE_CELLS)) if values is None else values.numpy())
        if any(row.any() for row in rows):
            columns[column] = Matrix.of(np.vstack(rows), "<f2")

    return Recollection(
        id=RECOLLECTION_ID,
        base_level=1.0,
        map=remembered.name,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        labels=remembered.known.labels,
        names=remembered.known.names,
        given_names=remembered.known.given_names,
        functions=remembered.known.functions,
        matched=found.matched,
        objects=remembered.known.objects,
        tiles=sorted(remembered.tiles),
        columns=columns,
        sub_maps=[] if remembered.tree is None else remembered.tree.sub_maps,
    )
