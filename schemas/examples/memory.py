"""Messages of long-term memory."""

from __future__ import annotations

import numpy as np

from cogmap.schemas.array import Matrix
from cogmap.schemas.examples.arrays import matrix
from cogmap.schemas.memory import (
    DeclarativeEpisode,
    Restored,
    Stored,
    StoredObjects,
    StoredRecord,
    StoredTile,
    StoredTree,
    TransientEpisode,
)
from cogmap.schemas.nodes import TILE_CELLS, PlaceColumn, Remembered, SubMap

MAP = "remembered:1"


def stored() -> Stored:
    """Objects of a map that were stored, and a tile; another was forgotten."""
    return Stored(cycle=7, records=_records(), forgotten=["remembered:2/objects"])


def restored() -> Restored:
    """The same, after a restart."""
    return Restored(records=_records())


def _records() -> list[StoredRecord]:
    return [_objects(), _tile(), _tree(), _transient(), _declarative()]


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


def _tree() -> StoredTree:
    district = SubMap(
        number=3,
        cell_m=0.75,
        x_m=10.5,
        y_m=-4.25,
        width_m=40.0,
        height_m=25.5,
        members=["bakery", "bakery~2"],
    )
    return StoredTree(map=MAP, sub_maps=[district])


def _transient() -> TransientEpisode:
    return TransientEpisode(
        number=8,
        run=2,
        map=MAP,
        x_m=12.5,
        y_m=-3.25,
        from_ns=1_000_000_000,
        until_ns=1_200_000_000,
        content=[Remembered(kind="object", label="bakery", salience=-0.5)],
        path=[(2.5, -3.25)],
        activation=0.75,
        active_ns=1_200_000_000,
    )


def _declarative() -> DeclarativeEpisode:
    return DeclarativeEpisode(
        number=3,
        run=1,
        map=MAP,
        x_m=2.5,
        y_m=-3.25,
        from_ns=400_000_000,
        until_ns=800_000_000,
        content=[Remembered(kind="need", label="energy", salience=-0.25)],
        path=[(-7.5, -3.25)],
    )
