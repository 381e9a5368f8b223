"""The global workspace: coalitions compete for consciousness, and the winner is broadcast (LIDA's
framework).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import (
    Broadcast,
    Coalition,
    Coalitions,
    Competition,
    Contender,
    Fate,
    Silence,
    Trigger,
)
from cogmap.services.global_workspace.config import Config

__all__ = ["Config", "GlobalWorkspace", "build"]

REMEMBERED_CYCLES = 64


@dataclass
class Candidate:
    """A coalition that competes, its id, and what is left of its activation."""

    id: str
    coalition: Coalition
    activation: float

    def with_fate(self, fate: Fate) -> Contender:
        """The candidate as the competition reports it."""
        return Contender(
            id=self.id,
            codelet=self.coalition.codelet,
            activation=max(0.0, self.activation),
            fate=fate,
        )


class GlobalWorkspace:
    """Holds one candidate of each attention codelet, and decides when one is broadcast."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._candidates: dict[str, Candidate] = {}
        self._now_ns = 0
        self._broadcast_ns: int | None = None
        self._new_ns = 0
        self._received: deque[tuple[int, int]] = deque(maxlen=REMEMBERED_CYCLES)

    def on_coalitions(self, coalitions: Coalitions) -> list[Message]:
        """Let a cycle's coalitions compete: a competition, after a broadcast if one was triggered.

        Raises MessageError where they were received before: a task that one worker lost is answered
        by two.
        """
        self._check_new(coalitions)
        losers = self._decay(max(0, coalitions.stamp_ns - self._now_ns))
        self._now_ns = max(self._now_ns, coalitions.stamp_ns)
        losers += self._enter(coalitions)

        silence = self._silence()
        trigger = Trigger.NONE if silence else self._trigger()
        winner = self._pop_winner() if trigger else None
        competition = Competition(
            stamp_ns=coalitions.stamp_ns,
            cycle=coalitions.cycle,
            contenders=self._report(winner, losers),
            trigger=trigger,
            silence=silence if silence or trigger else Silence.NO_TRIGGER,
        )
        if winner is None:
            return [competition]

        broadcast = Broadcast(
            stamp_ns=coalitions.stamp_ns,
            cycle=coalitions.cycle,
            trigger=trigger,
            coalition=winner.coalition,
        )

        return [broadcast, competition]

    def _check_new(self, coalitions: Coalitions) -> None:
        key = (coalitions.cycle, coalitions.stamp_ns)
        if key in self._received:
            raise MessageError(f"the coalitions of cycle {coalitions.cycle} came twice")

        self._received.append(key)

    def _decay(self, passed_ns: int) -> list[Contender]:
        """Take off activation for the time that passed; those that have none left."""
        lost = self._config.decay * self._ticks(passed_ns) / self._config.ticks_per_decay
        decayed = []
        for codelet, candidate in list(self._candidates.items()):
            candidate.activation -= lost
            if candidate.activation <= 0.0:
                decayed.append(candidate.with_fate(Fate.DECAYED))
                del self._candidates[codelet]

        return decayed

    def _enter(self, coalitions: Coalitions) -> list[Contender]:
        """Add the cycle's coalitions; those of the same codelets that they replace."""
        displaced = []
        for coalition in coalitions.coalitions:
            codelet = coalition.codelet
            before = self._candidates.get(codelet)
            if before is None:
                self._new_ns = self._now_ns
            else:
                displaced.append(before.with_fate(Fate.DISPLACED))
            name = coalition.id or f"{codelet}/{coalitions.cycle}"
            self._candidates[codelet] = Candidate(name, coalition, coalition.activation)

        return displaced

    def _silence(self) -> Silence:
        """Why no trigger may fire now; NONE where one may."""
        if not self._candidates:
            return Silence.NO_COALITION
        if self._silent_ticks() < self._config.refractory_ticks:
            return Silence.REFRACTORY
        return Silence.NONE

    def _trigger(self) -> Trigger:
        """The first trigger whose condition is met."""
        config = self._config
        activations = [candidate.activation for candidate in self._candidates.values()]
        silent_ticks = self._silent_ticks()
        old_ticks = self._ticks(self._now_ns - self._new_ns)
        conditions = {
            Trigger.ONE_COALITION: max(activations) > config.coalition_above,
            Trigger.AGGREGATE: sum(activations) > config.aggregate_above,
            Trigger.NO_BROADCAST: silent_ticks >= config.no_broadcast_ticks,
            Trigger.NO_NEW_COALITION: old_ticks >= config.no_new_coalition_ticks,
        }
        met = [trigger for trigger, is_met in conditions.items() if is_met]

        return met[0] if met else Trigger.NONE

    def _pop_winner(self) -> Candidate:
        """Take out the most active candidate, of equals the first by its codelet's name."""
        codelets = sorted(self._candidates)
        best = max(codelets, key=lambda codelet: self._candidates[codelet].activation)
        self._broadcast_ns = self._now_ns

        return self._candidates.pop(best)

    def _report(self, winner: Candidate | None, losers: list[Contender]) -> list[Contender]:
        """Every coalition that took part, by codelet, then id."""
        contenders = list(losers)
        if winner is not None:
            contenders.append(winner.with_fate(Fate.WON))

        waiting = self._candidates.values()
        contenders += [candidate.with_fate(Fate.WAITING) for candidate in waiting]

        return sorted(contenders, key=lambda each: (each.codelet, each.id))

    def _silent_ticks(self) -> float:
        if self._broadcast_ns is None:
            return math.inf
        return self._ticks(self._now_ns - self._broadcast_ns)

    def _ticks(self, duration_ns: int) -> float:
        return duration_ns / 1e6 / self._config.tick_ms


def build(config: Config, instance: str) -> Module:
    """The module `global_workspace`."""
    workspace = GlobalWorkspace(config)
    return Module("global_workspace", instance).on(
        topics.COALITIONS,
        workspace.on_coalitions,
        emits=[topics.COMPETITION, topics.BROADCAST],
    )
