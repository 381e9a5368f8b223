"""The episodes in Transient Episodic Memory and in Declarative Memory. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import TypeGuard

import msgspec

from cogmap.schemas.memory import DeclarativeEpisode, StoredRecord, TransientEpisode
from cogmap.services.memory.episodic.config import EpisodicConfig
from cogmap.services.memory.episodic.encoding import squares
from cogmap.services.memory.storing import Changes

HOUR_NS = 3_600_000_000_000

CONSOLIDATED_ACTIVATION = 0.6
"""Activation from which on an episode is consolidated; chosen, not tuned."""

MAX_TRANSIENT = 1000
"""Episodes in Transient Episodic Memory: some half an hour of driving. Sparse distributed memory
holds about as many with its defaults.
"""

KeptEpisode = TransientEpisode | DeclarativeEpisode


class Episodes:
    """The episodes by their numbers, and which of them are not stored as they are."""

    def __init__(self, config: EpisodicConfig) -> None:
        self._config = config
        self._known: dict[int, KeptEpisode] = {}
        self._changed: set[int] = set()
        self._forgotten: dict[str, None] = {}
        self._newest = 0

    @property
    def known(self) -> Mapping[int, KeptEpisode]:
        """Return all episodes by their numbers."""
        return MappingProxyType(self._known)

    def restore(self, records: Iterable[StoredRecord]) -> None:
        """Take up episodes that are stored."""
        for record in records:
            if is_episode(record):
                self._known[record.number] = record
                self._newest = max(self._newest, record.number)

    def next_number(self) -> int:
        """Return a number that no episode has had since the start."""
        self._newest += 1
        return self._newest

    def put(self, episode: KeptEpisode) -> None:
        """Keep an episode, in place of the one of its number."""
        if self._known.get(episode.number) != episode:
            self._known[episode.number] = episode
            self._changed.add(episode.number)
            # A store removes what is forgotten after it has put what has changed.
            self._forgotten.pop(episode.key, None)

    def forget(self, number: int) -> None:
        """Forget the episode of a number, if there is one."""
        forgotten = self._known.pop(number, None)
        self._changed.discard(number)
        if forgotten is not None:
            self._forgotten[forgotten.key] = None

    def reinforce(self, number: int, amount: float, now_ns: int) -> None:
        """Raise the activation of an episode in Transient Episodic Memory that was conscious."""
        episode = self._known.get(number)
        if isinstance(episode, TransientEpisode):
            level = min(1.0, self._activation(episode, now_ns) + amount)
            self.put(msgspec.structs.replace(episode, activation=level, active_ns=now_ns))

    def consolidate(self, run: int, now_ns: int) -> None:
        """Move what has lasted from Transient Episodic Memory to Declarative Memory, and forget
        what has decayed.

        How much time passed between two runs is not known: an earlier run's episodes are as active
        as when its last one ended, and none stays transient.
        """
        ends_ns = {run: now_ns}
        transient = [each for each in self._known.values() if isinstance(each, TransientEpisode)]
        for episode in transient:
            if episode.run != run:
                end_ns = ends_ns.get(episode.run, 0)
                ends_ns[episode.run] = max(end_ns, episode.until_ns)

        for episode in transient:
            level = self._activation(episode, ends_ns[episode.run])
            age_ns = now_ns - episode.until_ns
            is_over = episode.run != run or age_ns >= self._config.consolidation_h * HOUR_NS
            if is_over and level >= CONSOLIDATED_ACTIVATION:
                names = DeclarativeEpisode.__struct_fields__
                kept = {name: getattr(episode, name) for name in names}
                self.put(DeclarativeEpisode(**kept))
            elif episode.run != run or level <= 0.0:
                self.forget(episode.number)

        self._forget_weakest(now_ns)

        # Declarative Memory keeps the newest.
        known = self._known.items()
        numbers = sorted(number for number, each in known if isinstance(each, DeclarativeEpisode))
        for number in numbers[: -self._config.max_declarative]:
            self.forget(number)

    def relocate(self, moved: Callable[[KeptEpisode], KeptEpisode | None]) -> set[int]:
        """Put episodes elsewhere, or forget them if that is None. Return the numbers of those whose
        vectors are others now.
        """
        relocated = set()
        for episode in list(self._known.values()):
            after = moved(episode)
            if after == episode:
                continue

            if after is None:
                self.forget(episode.number)
                relocated.add(episode.number)
                continue

            self.put(after)
            if squares(after) != squares(episode):
                relocated.add(episode.number)

        return relocated

    def take_changes(self) -> Changes:
        """Take all that is not stored yet as it is; after this, everything counts as stored."""
        records: list[StoredRecord] = [self._known[number] for number in sorted(self._changed)]
        changes = Changes(records, list(self._forgotten))
        self._changed = set()
        self._forgotten = {}
        return changes

    def _forget_weakest(self, now_ns: int) -> None:
        """Forget the least active episodes in Transient Episodic Memory that are too many."""
        levels = {}
        for number, episode in self._known.items():
            if isinstance(episode, TransientEpisode):
                levels[number] = self._activation(episode, now_ns)

        strongest_last = sorted(levels, key=lambda number: (levels[number], number))
        for number in strongest_last[:-MAX_TRANSIENT]:
            self.forget(number)

    def _activation(self, episode: TransientEpisode, now_ns: int) -> float:
        """Compute an episode's activation now, by linear decay as in LIDA's framework."""
        hours = max(0, now_ns - episode.active_ns) / HOUR_NS
        return max(0.0, episode.activation - self._config.decay_per_h * hours)


def is_episode(record: StoredRecord) -> TypeGuard[KeptEpisode]:
    """Decide whether a record is of an episode, in either memory."""
    return isinstance(record, KeptEpisode)
