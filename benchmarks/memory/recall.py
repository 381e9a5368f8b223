"""Recall of cognitive maps from corrupted cues by a sparse distributed memory.

A map is a record: a few objects, of kinds that other maps have too, each bound to the role of the
place that it is at. The maps are stored at themselves, and each cue is one of them in which a share
of the dimensions has other values.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Bytes
from cogmap.services.memory.public import ItemMemory, ModularMemory, SparseConfig, vectors

MAPS = 1000
CUES = 500
BROADCASTS = 3
CORRUPTED_SHARE = 0.3
KINDS = 200
GRID_SIDE = 10
OBJECTS = (4, 10)


def recall_corrupted(seed: int, maps: int = MAPS) -> float:
    """Return the share of up to CUES of the maps that a modular memory recalls rightly.

    They are written to it in as many rounds as there are broadcasts, each in an order of its own. A
    recall is right if of all maps it is nearest to the right one, related to it, and nearer to it
    than the cue was.
    """
    memory = ModularMemory(SparseConfig(seed=seed))
    rng = np.random.default_rng([seed, 0])
    items = ItemMemory(seed, memory.dimensions, memory.values)
    stored = np.stack([random_map(items, rng) for _ in range(maps)])

    for _ in range(BROADCASTS):
        for number in rng.permutation(maps):
            memory.write(stored[number], stored[number])

    are_right = []
    for number in rng.permutation(maps)[:CUES].tolist():
        cue = corrupted(stored[number], CORRUPTED_SHARE, memory.values, rng)
        recall = memory.read(cue)
        if recall is None:
            are_right.append(False)
            continue

        apart = vectors.distances(stored, recall.vector, memory.values)
        cue_apart = vectors.distances(stored[number], cue, memory.values)
        is_nearest = apart.argmin() == number
        is_related = apart[number] < vectors.contained_below(memory.dimensions, memory.values)
        are_right.append(bool(is_nearest and is_related and apart[number] < cue_apart))

    return float(np.mean(are_right))


def corrupted(vector: Bytes, share: float, values: int, rng: np.random.Generator) -> Bytes:
    """Return a vector with a share of its dimensions replaced by values drawn uniformly."""
    replaced = rng.permutation(len(vector))[: round(share * len(vector))]
    (noise,) = vectors.random_vectors(rng, 1, len(replaced), values)

    cue = vector.copy()
    cue[replaced] = noise
    return cue


def random_map(items: ItemMemory, rng: np.random.Generator) -> Bytes:
    """Return some objects at different places of a grid."""
    count = int(rng.integers(*OBJECTS, endpoint=True))
    places = rng.permutation(GRID_SIDE**2)[:count]
    kinds = rng.integers(0, KINDS, count)

    fillers = {}
    for place, kind in zip(places.tolist(), kinds.tolist(), strict=True):
        fillers[f"place {place}"] = f"object {kind}"

    parts = [items.filled(place, kind) for place, kind in sorted(fillers.items())]
    return vectors.bundle(np.stack(parts), items.values)
