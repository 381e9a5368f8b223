"""The cognitive maps in long-term memory, and the records that they are stored in. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.schemas.array import Matrix
from cogmap.schemas.memory import StoredObjects, StoredRecord, StoredTile, StoredTree, tile_key
from cogmap.schemas.nodes import PlaceColumn, RecalledColumn

NUMBERED = "remembered:"
POSITION = slice(RecalledColumn.X_M, RecalledColumn.Y_M + 1)


@dataclass
class RememberedMap:
    """A map that was learned: its objects, its sub-maps, and the squares of place nodes by their
    position.
    """

    name: str
    known: StoredObjects | None = None
    tree: StoredTree | None = None
    tiles: dict[tuple[int, int], dict[PlaceColumn, Matrix]] = field(default_factory=dict)

    @property
    def keys(self) -> list[str]:
        """Return the keys of its records."""
        whole = [each.key for each in (self.known, self.tree) if each is not None]
        return whole + [tile_key(self.name, x, y) for x, y in sorted(self.tiles)]

    @property
    def looks(self) -> list[str]:
        """Return what each of its objects looks like."""
        return [] if self.known is None else self.known.names

    @property
    def at_m(self) -> Floats:
        """Return where its objects stand, (n, 2)."""
        if self.known is None:
            return np.zeros((0, 2))

        rows = np.asarray(self.known.objects.numpy(), np.float64)
        return rows[:, POSITION]


class RememberedMaps:
    """All maps in long-term memory, by name."""

    def __init__(self) -> None:
        self._maps: dict[str, RememberedMap] = {}

    def put(self, records: Iterable[StoredRecord]) -> None:
        """Take in records, each in place of the one of its key; an episode has a map by its name
        alone.
        """
        for record in records:
            remembered = self._maps.setdefault(record.map, RememberedMap(record.map))
            if isinstance(record, StoredTile):
                remembered.tiles[record.x, record.y] = record.columns
            elif isinstance(record, StoredObjects):
                remembered.known = record
            elif isinstance(record, StoredTree):
                remembered.tree = record

    def forget(self, name: str) -> list[str]:
        """Remove the map of that name, if there is one; return the keys of its records."""
        forgotten = self._maps.pop(name, None)
        return [] if forgotten is None else forgotten.keys

    def get(self, name: str) -> RememberedMap | None:
        """Return the map of that name; None if there is none."""
        return self._maps.get(name)

    def others(self, name: str) -> list[RememberedMap]:
        """Return the maps with objects, except the one of that name, sorted by name."""
        found = []
        for other in sorted(self._maps):
            remembered = self._maps[other]
            if other != name and remembered.known is not None:
                found.append(remembered)

        return found

    def next_name(self) -> str:
        """Make a name that no map has, with the first free number."""
        number = 1
        while f"{NUMBERED}{number}" in self._maps:
            number += 1

        return f"{NUMBERED}{number}"
