"""A cognitive map recalled from long-term memory (beyond the paper, which leaves that open)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import msgspec

from cogmap.schemas.array import Matrix
from cogmap.schemas.base import Finite, Metres, Name, Part
from cogmap.schemas.nodes.base import GraphNode
from cogmap.schemas.nodes.columns import TILE_CELLS, PlaceColumn, RecalledColumn, check_matrix

TileNumber = Annotated[int, msgspec.Meta(ge=-(2**31), le=2**31)]
MapNumber = Annotated[int, msgspec.Meta(ge=1, le=2**31)]


class SubMap(Part, kw_only=True, frozen=True):
    """A sub-map of a map in long-term memory: its number, and that of its parent, 0 the map itself;
    its frame in that of its parent, its sides, the distance between its places; and the labels of
    the objects in it.
    """

    number: MapNumber
    parent: Annotated[int, msgspec.Meta(ge=0, le=2**31)] = 0
    cell_m: Annotated[float, msgspec.Meta(gt=0, le=1e4)]
    x_m: Finite
    y_m: Finite
    heading_rad: Finite = 0.0
    width_m: Metres
    height_m: Metres
    members: list[Name]


class Recollection(GraphNode, kw_only=True, frozen=True, tag="recollection"):
    """A map that long-term memory takes for the town around, until it is joined to the root map.

    `x_m`, `y_m` and `heading_rad` are the pose of the root map's frame in that of the recalled map
    `map`, whose places are as far apart. `labels`, `names`, the names that people have given, and
    `functions` are those of the objects whose positions and sizes are in `objects`, see
    RecalledColumn; `matched` are the labels that they have on the root map, empty if they have
    none. `tiles` are the squares of place nodes that are known, and `columns` their values,
    (k, TILE_CELLS) float16 each, row-major as in a tile.
    `sub_maps` is the tree below it, of objects by their labels in `labels`.
    """

    map: Name
    x_m: Finite
    y_m: Finite
    heading_rad: Finite
    labels: list[Name]
    names: list[str]
    given_names: list[str]
    functions: list[str]
    matched: list[str]
    objects: Matrix
    tiles: list[tuple[TileNumber, TileNumber]] = []
    columns: dict[PlaceColumn, Matrix] = {}
    sub_maps: list[SubMap] = []

    def __post_init__(self) -> None:
        check_matrix(self.id, self.objects, "<f8", (len(RecalledColumn),))
        count, _ = self.objects.shape
        columns = (self.labels, self.names, self.given_names, self.functions, self.matched)
        if {len(column) for column in columns} != {count}:
            raise ValueError(f"{self.id}: {count} objects, and other numbers of their names")

        for name, values in self.columns.items():
            if values.dtype != "<f2" or values.shape != (len(self.tiles), TILE_CELLS):
                raise ValueError(f"{self.id}: {name} of shape {values.shape}")

        check_tree(self.id, self.sub_maps)


def check_tree(name: str, sub_maps: Sequence[SubMap]) -> None:
    """Raise ValueError if sub-maps are no tree: if one has no parent before it, or is there twice,
    or an object is in two.
    """
    known = {0}
    members: set[str] = set()
    for each in sub_maps:
        if each.number in known or each.parent not in known:
            raise ValueError(f"{name}: sub-map {each.number} below {each.parent} is in no tree")
        if not members.isdisjoint(each.members):
            raise ValueError(f"{name}: an object of sub-map {each.number} is in another too")

        known.add(each.number)
        members.update(each.members)
