"""How many cognitive maps a sparse distributed memory recalls from corrupted cues.

A map is a record: a few objects, of kinds that other maps have too, each bound to the role of the
place where it is. The maps are stored at themselves, and each cue is one of them in which a share
of the dimensions has other values.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.report import Metrics
from cogmap.geometry.arrays import Bytes
from cogmap.services.memory.sparse.build import build
from cogmap.services.memory.sparse.config import SparseConfig
from cogmap.services.memory.sparse.interface import AssociativeMemory
from cogmap.services.memory.sparse.structures import ItemMemory
from cogmap.services.memory.sparse.vectors import bundle, contained_below, distances, random_vectors

MAPS = 1000
CUES = 500
BROADCASTS = 3
CORRUPTED_SHARE = 0.3
KINDS = 200
GRID_SIDE = 10
OBJECTS = (4, 10)


@dataclass(frozen=True)
class Recalled:
    """The shares of the cues whose map was recalled rightly, and as it was stored to the last
    dimension, and of those whose read converged.
    """

    right: float
    identical: float
    converged: float


def recall_corrupted(
    seed: int,
    maps: int = MAPS,
    corrupted_share: float = CORRUPTED_SHARE,
    broadcasts: int = BROADCASTS,
) -> float:
    """The share of the maps that a modular memory recalls rightly."""
    memory = build(SparseConfig(seed=seed))
    return recalled(memory, seed, maps, corrupted_share, broadcasts).right


def recall_corrupted_binary(
    seed: int, maps: int = MAPS, corrupted_share: float = CORRUPTED_SHARE
) -> float:
    """The same share of a binary memory with LIDA's parameters, to which a broadcast more makes no
    difference.
    """
    memory = build(SparseConfig(kind="binary", seed=seed))
    return recalled(memory, seed, maps, corrupted_share, 1).right


def metrics(seed: int) -> Metrics:
    """The shares after several broadcasts, after one, and of a binary memory."""
    modular = SparseConfig(seed=seed)
    several = recalled(build(modular), seed, MAPS, CORRUPTED_SHARE, BROADCASTS)
    once = recalled(build(modular), seed, MAPS, CORRUPTED_SHARE, 1)

    return {
        "recall_corrupted_30": several.right,
        "recall_corrupted_30_identical": several.identical,
        "recall_corrupted_30_converged": several.converged,
        "recall_corrupted_30_broadcast_once": once.right,
        "recall_corrupted_30_binary": recall_corrupted_binary(seed),
    }


def recalled(
    memory: AssociativeMemory, seed: int, maps: int, corrupted_share: float, broadcasts: int
) -> Recalled:
    """Maps written to an empty memory in as many rounds as there are broadcasts, each in an order
    of its own, and then recalled, up to CUES of them.
    """
    rng = np.random.default_rng([seed, 0])
    items = ItemMemory(seed, memory.dimensions, memory.values)
    stored = np.stack([_map(items, rng) for _ in range(maps)])

    for _ in range(broadcasts):
        for number in rng.permutation(maps):
            memory.write(stored[number], stored[number])

    chosen = rng.permutation(maps)[:CUES]
    outcomes = []
    for number in chosen.tolist():
        cue = corrupted(stored[number], corrupted_share, memory.values, rng)
        outcomes.append(_outcome(memory, stored, number, cue))

    right, identical, converged = np.mean(outcomes, axis=0).tolist()
    return Recalled(right, identical, converged)


def corrupted(vector: Bytes, share: float, values: int, rng: np.random.Generator) -> Bytes:
    """A vector with a share of its dimensions replaced by values drawn uniformly."""
    replaced = rng.permutation(len(vector))[: round(share * len(vector))]
    (noise,) = random_vectors(rng, 1, len(replaced), values)

    cue = vector.copy()
    cue[replaced] = noise
    return cue


def _map(items: ItemMemory, rng: np.random.Generator) -> Bytes:
    """Some objects at different places of a grid."""
    least, most = OBJECTS
    count = int(rng.integers(least, most, endpoint=True))
    places = rng.permutation(GRID_SIDE**2)[:count]
    kinds = rng.integers(0, KINDS, count)

    fillers = {}
    for place, kind in zip(places.tolist(), kinds.tolist(), strict=True):
        fillers[f"place {place}"] = f"object {kind}"

    parts = [items.filled(place, kind) for place, kind in sorted(fillers.items())]
    return bundle(np.stack(parts), items.values)


def _outcome(
    memory: AssociativeMemory, stored: Bytes, number: int, cue: Bytes
) -> tuple[bool, bool, bool]:
    """Whether a recall is right: nearest of all maps to the right one, related to it, and nearer to
    it than the cue was. Then whether it is identical, and whether the read converged.
    """
    recall = memory.read(cue)
    if recall is None:
        return False, False, False

    apart = distances(stored, recall.vector, memory.values)
    before = distances(stored[number], cue, memory.values)
    is_nearest = bool(apart.argmin() == number)
    is_related = bool(apart[number] < contained_below(memory.dimensions, memory.values))
    is_nearer = bool(apart[number] < before)

    is_right = is_nearest and is_related and is_nearer
    return is_right, bool(apart[number] == 0), recall.converged
