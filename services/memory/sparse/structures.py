"""Names, and sequences of them, as vectors.

Of 1,024 dimensions, a vector of 16 values holds about 25 parts, and one of bits about 10, before
some are lost in the noise of the others. Pure.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from cogmap.geometry.arrays import Bytes
from cogmap.services.memory.sparse.vectors import VALUES, bind, bundle, permuted

# So many vectors are not drawn anew: a town's names are fewer, but each goal has one of its own.
RECENT = 512


class ItemMemory:
    """The vectors of names: the same for the same seed, on every machine, and unrelated for
    different names.
    """

    def __init__(self, seed: int, dimensions: int, values: int = VALUES) -> None:
        self.dimensions = dimensions
        self.values = values
        self._seed = seed

    def item(self, name: str) -> Bytes:
        """Return the vector of an item."""
        return self._drawn("item", name)

    def role(self, name: str) -> Bytes:
        """Return the vector of a role, which is unrelated to that of an item of the same name."""
        return self._drawn("role", name)

    def filled(self, role: str, name: str) -> Bytes:
        """Return the item of a name, bound to a role."""
        return bind(self.role(role), self.item(name), self.values)

    def _drawn(self, kind: str, name: str) -> Bytes:
        return _drawn(f"{self._seed} {kind} {name}", self.dimensions, self.values)


@lru_cache(maxsize=RECENT)
def _drawn(key: str, dimensions: int, values: int) -> Bytes:
    """Draw values from a hash: no version of a random generator changes what is stored."""
    drawn = hashlib.shake_256(key.encode()).digest(dimensions)
    return np.frombuffer(drawn, np.uint8) & np.uint8(values - 1)


def encode_sequence(items: ItemMemory, names: Sequence[str]) -> Bytes:
    """Bundle the items, each permuted by its place in the sequence.

    Raises ValueError if there are none.
    """
    parts = [permuted(items.item(name), place) for place, name in enumerate(names)]
    return bundle(np.stack(parts), items.values)
