"""Clean-up memory: which stored vector it is that was read (Plate 1995)."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

import numpy as np

from cogmap.geometry.arrays import Bytes
from cogmap.services.memory.sparse.vectors import VALUES, contains, distances

Key = TypeVar("Key", bound=Hashable)


class CleanUpMemory(Generic[Key]):
    """Vectors of `values` values by their keys."""

    def __init__(self, values: int = VALUES) -> None:
        self._values = values
        self._vectors: dict[Key, Bytes] = {}

    @property
    def keys(self) -> set[Key]:
        """Return the keys of all vectors."""
        return set(self._vectors)

    def put(self, key: Key, vector: Bytes) -> None:
        """Keep a vector, in place of the one of its key."""
        self._vectors[key] = vector

    def forget(self, key: Key) -> None:
        """Remove the vector of a key, which is there."""
        del self._vectors[key]

    def get(self, key: Key) -> Bytes:
        """Return the vector of a key. Raises KeyError if there is none."""
        return self._vectors[key]

    def nearest(
        self, vector: Bytes, is_wanted: Callable[[Key], bool] = lambda _: True
    ) -> Key | None:
        """Find the key of the wanted vector that is nearest to `vector`; None if `vector` is
        related to none.
        """
        keys = [key for key in self._vectors if is_wanted(key)]
        if not keys:
            return None

        rows = np.stack([self._vectors[key] for key in keys])
        nearest = int(distances(rows, vector, self._values).argmin())
        return keys[nearest] if contains(rows[nearest], vector, self._values) else None
