"""A cognitive map recalled from long-term memory (beyond the paper, which leaves that open)."""

from __future__ import annotations

from typing import Annotated

import msgspec

from schemas.array import Matrix
from schemas.base import Finite, Name
from schemas.nodes.base import GraphNode
from schemas.nodes.columns import TILE_CELLS, PlaceColumn, RecalledColumn, check_matrix

TileNumber = Annotated[int, msgspec.Meta(ge=-(2**31), le=2**31)]


class Recollection(GraphNode, kw_only=True, frozen=True, tag="recollection"):
    """A map that long-term memory takes for the town around, until it is joined to the root map.

    `x_m`, `y_m` and `heading_rad` are the pose of the root map's frame in that of the recalled map
    `map`, whose places are as far apart. `labels` and `functions` are those of the objects whose
    positions and sizes are in `objects`, see RecalledColumn; `matched` are the labels that they
    have on the root map, empty where they have none. `tiles` are the squares of place nodes that
    are known, and `columns` their values, (k, TILE_CELLS) float16 each, row-major as in a tile.
    """

    map: Name
    x_m: Finite
    y_m: Finite
    heading_rad: Finite
    labels: list[Name]
    functions: list[str]
    matched: list[str]
    objects: Matrix
    tiles: list[tuple[TileNumber, TileNumber]] = []
    columns: dict[PlaceColumn, Matrix] = {}

    def __post_init__(self) -> None:
        check_matrix(self.id, self.objects, "<f8", (len(RecalledColumn),))
        count, _ = self.objects.shape
        if {len(self.labels), len(self.functions), len(self.matched)} != {count}:
            raise ValueError(f"{self.id}: {count} objects, and other numbers of their names")

        for name, values in self.columns.items():
            if values.dtype != "<f2" or values.shape != (len(self.tiles), TILE_CELLS):
                raise ValueError(f"{self.id}: {name} of shape {values.shape}")
