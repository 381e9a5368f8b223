"""Which stored maps the objects around remind of: each object, with what stands around it, is a
vector in sparse distributed memory. Pure.

A map is so recalled from a part of it, at a cost that does not grow with the number of maps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from cogmap.geometry.arrays import Bytes, Floats
from cogmap.services.memory.sparse.build import build
from cogmap.services.memory.sparse.clean_up import CleanUpMemory
from cogmap.services.memory.sparse.config import SparseConfig
from cogmap.services.memory.sparse.structures import ItemMemory
from cogmap.services.memory.sparse.vectors import bundle

# An object's vector has its so many nearest neighbours, with distances in such steps.
NEIGHBOURS = 6
APART_STEP_M = 5.0
LOOK = "look"


class Associations:
    """Objects of maps as vectors: what one looks like, and how far away its nearest neighbours are,
    by their looks.
    """

    def __init__(self, config: SparseConfig) -> None:
        self._memory = build(config)
        self._items = ItemMemory(config.seed, self._memory.dimensions, self._memory.values)
        self._objects: CleanUpMemory[tuple[str, int]] = CleanUpMemory(self._memory.values)

    def learn(self, name: str, looks: Sequence[str], at_m: Floats) -> None:
        """Store the objects of the map `name`, (n, 2), each at itself."""
        for number, vector in enumerate(self._encoded(looks, at_m)):
            self._memory.write(vector, vector)
            self._objects.put((name, number), vector)

    def reminded_of(self, looks: Sequence[str], at_m: Floats) -> list[str]:
        """Return the maps that objects here, (n, 2), remind of, by how many of them do."""
        votes: Counter[str] = Counter()
        for vector in self._encoded(looks, at_m):
            name = self._map_of(vector)
            if name is not None:
                votes[name] += 1

        return [name for name, _ in sorted(votes.items(), key=lambda vote: (-vote[1], vote[0]))]

    def _map_of(self, cue: Bytes) -> str | None:
        """Return the map of the stored object that a cue recalls; None if it recalls none."""
        recall = self._memory.read(cue)
        if recall is None:
            return None

        nearest = self._objects.nearest(recall.vector)
        return None if nearest is None else nearest[0]

    def _encoded(self, looks: Sequence[str], at_m: Floats) -> list[Bytes]:
        """Encode each object as a vector."""
        offsets_m = at_m[:, None] - at_m
        apart_m = np.hypot(offsets_m[..., 0], offsets_m[..., 1])
        nearest = np.argsort(apart_m, axis=1, kind="stable")[:, 1 : 1 + NEIGHBOURS]

        vectors = []
        for number, look in enumerate(looks):
            parts = [self._items.filled(LOOK, look)]
            for neighbour in nearest[number].tolist():
                steps = round(apart_m[number, neighbour] / APART_STEP_M)
                parts.append(self._items.filled(str(steps), looks[neighbour]))
            vectors.append(bundle(np.stack(parts), self._memory.values))

        return vectors
