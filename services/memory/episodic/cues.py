"""Which episode a cue recalls: episodes as vectors in sparse distributed memory. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from cogmap.schemas.memory import StoredEpisode
from cogmap.services.memory.episodic.encoding import cues, encoded
from cogmap.services.memory.sparse.build import build
from cogmap.services.memory.sparse.clean_up import CleanUpMemory
from cogmap.services.memory.sparse.config import SparseConfig
from cogmap.services.memory.sparse.structures import ItemMemory
from cogmap.services.memory.sparse.vectors import distance, mean_distance

MAX_LEARNED = 50
"""So many episodes are learned at once, in a quarter of a second, where many were restored."""


class Found(NamedTuple):
    """The number of a recalled episode, and how well it matches the cue, from 0, unrelated, to 1,
    the same.
    """

    number: int
    match: float


class EpisodicCues:
    """Episodes, each stored at itself."""

    def __init__(self, config: SparseConfig) -> None:
        self._memory = build(config)
        self._items = ItemMemory(config.seed, self._memory.dimensions, self._memory.values)
        self._stored: CleanUpMemory[int] = CleanUpMemory(self._memory.values)

    def hold(self, episodes: Mapping[int, StoredEpisode]) -> None:
        """Learn the next of `episodes` that are not stored yet, and recall no others.

        What sparse distributed memory holds of the others stays there as interference.
        """
        for number in sorted(self._stored.keys - set(episodes)):
            self._stored.forget(number)

        lacking = sorted(set(episodes) - self._stored.keys)
        for number in lacking[:MAX_LEARNED]:
            vector = encoded(episodes[number], self._items)
            self._memory.write(vector, vector)
            self._stored.put(number, vector)

    def recalled(self, cue: StoredEpisode, is_wanted: Callable[[int], bool]) -> Found | None:
        """Complete a cue, at its place and those beside it, to the wanted episode that matches it
        best; None if there is none.
        """
        found = []
        for vector in cues(cue, self._items):
            recall = self._memory.read(vector)
            if recall is None:
                continue

            number = self._stored.nearest(recall.vector, is_wanted)
            if number is not None:
                apart = distance(self._stored.get(number), vector, self._memory.values)
                match = 1.0 - apart / mean_distance(self._memory.dimensions, self._memory.values)
                found.append(Found(number, min(1.0, max(0.0, match))))

        return max(found, key=lambda each: (each.match, each.number), default=None)
