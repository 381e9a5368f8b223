"""Records and sequences of named items as single vectors, and what can be read back from them.

Of 1,024 dimensions, a vector of 16 values holds about 25 parts, and one of bits about 10, before
some are lost in the noise of the others. Pure.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence

import numpy as np

from cogmap.geometry.arrays import Bytes
from services.memory.sparse.vectors import (
    VALUES,
    bind,
    bundle,
    contained_below,
    distances,
    permuted,
    unbind,
)


class ItemMemory:
    """The vectors of names: the same for the same seed, on every machine, and unrelated for
    different names.
    """

    def __init__(self, seed: int, dimensions: int, values: int = VALUES) -> None:
        self.dimensions = dimensions
        self.values = values
        self._seed = seed
        self._items: dict[str, Bytes] = {}

    def item(self, name: str) -> Bytes:
        """The vector of an item, which is known from now on."""
        if name not in self._items:
            self._items[name] = self._drawn("item", name)
        return self._items[name]

    def role(self, name: str) -> Bytes:
        """The vector of a role, which is unrelated to that of an item of the same name."""
        return self._drawn("role", name)

    def clean_up(self, vector: Bytes) -> str | None:
        """The known item that is nearest to a vector; None where it contains none."""
        if not self._items:
            return None

        names = list(self._items)
        apart = distances(np.stack(list(self._items.values())), vector, self.values)
        nearest = int(apart.argmin())
        if apart[nearest] >= contained_below(self.dimensions, self.values):
            return None

        return names[nearest]

    def _drawn(self, kind: str, name: str) -> Bytes:
        """Values from a hash: no version of a random generator changes what is stored."""
        key = f"{self._seed} {kind} {name}".encode()
        drawn = hashlib.shake_256(key).digest(self.dimensions)
        return np.frombuffer(drawn, np.uint8) & np.uint8(self.values - 1)


def encode_record(items: ItemMemory, fillers: Mapping[str, str]) -> Bytes:
    """The bundle of each role bound to its filler, the same in whatever order they are given.

    Raises ValueError if there are none.
    """
    parts = []
    for role, filler in sorted(fillers.items()):
        parts.append(bind(items.role(role), items.item(filler), items.values))

    return bundle(np.stack(parts), items.values)


def decode_filler(items: ItemMemory, record: Bytes, role: str) -> str | None:
    """What fills a role of a record; None where that is no known item."""
    filler = unbind(record, items.role(role), items.values)
    return items.clean_up(filler)


def encode_sequence(items: ItemMemory, names: Sequence[str]) -> Bytes:
    """The bundle of the items, each permuted by its place in the sequence.

    Raises ValueError if there are none.
    """
    parts = [permuted(items.item(name), place) for place, name in enumerate(names)]
    return bundle(np.stack(parts), items.values)


def decode_sequence(items: ItemMemory, sequence: Bytes) -> list[str]:
    """The items of a sequence, up to the first that is not known."""
    names: list[str] = []
    for place in range(items.dimensions):
        name = items.clean_up(permuted(sequence, -place))
        if name is None:
            break
        names.append(name)

    return names
