"""Messages of long-term memory."""

from __future__ import annotations

import numpy as np

from schemas.array import Matrix
from schemas.examples.arrays import matrix
from schemas.memory import Restored, Stored, StoredObjects, StoredTile
from schemas.nodes import TILE_CELLS, PlaceColumn

MAP = "remembered:1"


def stored() -> Stored:
    """Objects of a map that were stored, and a tile; another was forgotten."""
    return Stored(cycle=7, records=[_objects(), _tile()], forgotten=["remembered:2/objects"])


def restored() -> Restored:
    """The same, after a restart."""
    return Restored(records=[_objects(), _tile()])


def _objects() -> StoredObjects:
    return StoredObjects(
        map=MAP,
        cell_m=1.5,
        labels=["bakery", "bakery~2"],
        functions=["shop", ""],
        objects=matrix(2, 7),
    )


def _tile() -> StoredTile:
    road = Matrix.of(np.full((1, TILE_CELLS), 0.5), "<f2")
    return StoredTile(map=MAP, x=-1, y=2, columns={PlaceColumn.ROAD: road})
