"""What long-term memory stores, as records: cognitive maps that were broadcast, and episodes."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.schemas.array import Matrix
from cogmap.schemas.base import Count, Finite, Message, Name, Part, Unit
from cogmap.schemas.nodes import TILE_CELLS, PlaceColumn, RecalledColumn, Remembered, SubMap
from cogmap.schemas.nodes.columns import check_matrix
from cogmap.schemas.nodes.recollection import TileNumber, check_tree


class StoredObjects(Part, kw_only=True, frozen=True, tag="objects"):
    """The objects of a map: their labels, what perception and people call them, and functions, and
    their positions and sizes in `objects`, float64 (n, 7), see RecalledColumn, in the map's own
    frame.
    """

    map: Name
    cell_m: Annotated[float, msgspec.Meta(gt=0, le=1e4)]
    labels: list[Name]
    names: list[str]
    given_names: list[str]
    functions: list[str]
    objects: Matrix

    def __post_init__(self) -> None:
        check_matrix(self.map, self.objects, "<f8", (len(RecalledColumn),))
        count, _ = self.objects.shape
        columns = (self.labels, self.names, self.given_names, self.functions)
        if {len(column) for column in columns} != {count}:
            raise ValueError(f"{self.map}: {count} objects, and other numbers of their names")

    @property
    def key(self) -> str:
        """Return the key of the record that it replaces."""
        return f"{self.map}/objects"


class StoredTile(Part, kw_only=True, frozen=True, tag="tile"):
    """A square of a map's place nodes: columns of float16 (1, TILE_CELLS) each, row-major."""

    map: Name
    x: TileNumber
    y: TileNumber
    columns: dict[PlaceColumn, Matrix]

    def __post_init__(self) -> None:
        for name, values in self.columns.items():
            if values.dtype != "<f2" or values.shape != (1, TILE_CELLS):
                raise ValueError(f"{self.map}: {name} of shape {values.shape}")

    @property
    def key(self) -> str:
        """Return the key of the record that it replaces."""
        return tile_key(self.map, self.x, self.y)


class StoredTree(Part, kw_only=True, frozen=True, tag="tree"):
    """The tree of a map's sub-maps, each after its parent, with the labels of the objects in it."""

    map: Name
    sub_maps: list[SubMap]

    def __post_init__(self) -> None:
        check_tree(self.map, self.sub_maps)

    @property
    def key(self) -> str:
        """Return the key of the record that it replaces."""
        return f"{self.map}/tree"


class StoredEpisode(Part, kw_only=True, frozen=True):
    """What, where and when: the nodes that were conscious at a place, from `from_ns` to `until_ns`
    of the run `run`, the first being 1.

    The place is (`x_m`, `y_m`) of the map `map`, in its own frame; `path` has the places of the
    episodes before it, the last one first. Episodes are numbered from 1.
    """

    number: Count
    run: Count
    map: Name
    x_m: Finite
    y_m: Finite
    from_ns: Count
    until_ns: Count
    content: list[Remembered]
    path: list[tuple[Finite, Finite]] = []

    @property
    def key(self) -> str:
        """Return the key of the record that it replaces."""
        return f"episode/{self.number}"


class TransientEpisode(StoredEpisode, kw_only=True, frozen=True, tag="transient"):
    """An episode in Transient Episodic Memory: its activation, which decays, as of `active_ns`."""

    activation: Unit
    active_ns: Count


class DeclarativeEpisode(StoredEpisode, kw_only=True, frozen=True, tag="declarative"):
    """An episode that was consolidated to Declarative Memory, where it does not decay."""


StoredRecord = StoredObjects | StoredTile | StoredTree | TransientEpisode | DeclarativeEpisode
"""One record of long-term memory; it replaces the one of its key."""


class Stored(Message, kw_only=True, frozen=True):
    """Records that are in the database from here on, and the keys of those that no longer are."""

    cycle: Count
    records: list[StoredRecord]
    forgotten: list[Name] = []


class Restored(Message, kw_only=True, frozen=True):
    """What the database held when its process started."""

    records: list[StoredRecord]


def tile_key(map_name: str, x: int, y: int) -> str:
    """Return the key of the record of a square of a map's place nodes."""
    return f"{map_name}/tile/{x}/{y}"


def kind_of_record(record: StoredRecord) -> str:
    """Return the name of a record's kind, as it travels."""
    return str(type(record).__struct_config__.tag)
