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
from cogmap.services.global_workspace.config import (
    NO_NEW_COALITION_TICKS,
    TICK_MS,
    TICKS_PER_DECAY,
    Config,
)

__all__ = ["Config", "GlobalWorkspace", "build"]

# A bound: coalitions that come twice, for a worker was lost, do so within moments.
REMEMBERED_CYCLES = 64


@dataclass
class Candidate:
    """A coalition that competes, its id, and what is left of its activation."""

    id: str
    coalition: Coalition
    activation: float

    def with_fate(self, fate: Fate) -> Contender:
        """Return the candidate as the competition reports it."""
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

        Raises MessageError if they were received before: a task that one worker lost is answered
        by two.
        """
        key = (coalitions.cycle, coalitions.stamp_ns)
        if key in self._received:
            raise MessageError(f"the coalitions of cycle {coalitions.cycle} came twice")
        self._received.append(key)

        contenders = self._decay(max(0, coalitions.stamp_ns - self._now_ns))
        self._be_at(coalitions.stamp_ns)
        for coalition in coalitions.coalitions:
            codelet = coalition.codelet
            before = self._candidates.get(codelet)
            if before is None:
                self._new_ns = self._now_ns
            else:
                contenders.append(before.with_fate(Fate.DISPLACED))
            name = coalition.id or f"{codelet}/{coalitions.cycle}"
            self._candidates[codelet] = Candidate(name, coalition, coalition.activation)

        silence, trigger = self._decide()
        published: list[Message] = []
        if trigger:
            # The most active wins, of equals the first by its codelet's name.
            codelets = sorted(self._candidates)
            best = max(codelets, key=lambda codelet: self._candidates[codelet].activation)
            winner = self._candidates.pop(best)
            contenders.append(winner.with_fate(Fate.WON))
            self._broadcast_ns = self._now_ns
            broadcast = Broadcast(
                stamp_ns=coalitions.stamp_ns,
                cycle=coalitions.cycle,
                trigger=trigger,
                coalition=winner.coalition,
            )
            published.append(broadcast)

        contenders += [each.with_fate(Fate.WAITING) for each in self._candidates.values()]
        competition = Competition(
            stamp_ns=coalitions.stamp_ns,
            cycle=coalitions.cycle,
            contenders=sorted(contenders, key=lambda each: (each.codelet, each.id)),
            trigger=trigger,
            silence=silence,
        )
        return [*published, competition]

    def _be_at(self, now_ns: int) -> None:
        """Let it be `now_ns`. Where time goes back, nothing has happened later than that."""
        self._now_ns = now_ns
        self._new_ns = min(self._new_ns, now_ns)
        if self._broadcast_ns is not None:
            self._broadcast_ns = min(self._broadcast_ns, now_ns)

    def _decay(self, passed_ns: int) -> list[Contender]:
        """Take off activation for the time that passed; those that have none left."""
        lost = self._config.decay * _ticks(passed_ns) / TICKS_PER_DECAY
        decayed = []
        for codelet, candidate in list(self._candidates.items()):
            candidate.activation -= lost
            if candidate.activation <= 0.0:
                decayed.append(candidate.with_fate(Fate.DECAYED))
                del self._candidates[codelet]

        return decayed

    def _decide(self) -> tuple[Silence, Trigger]:
        """Find why nothing is broadcast now, or the first trigger whose condition is met."""
        config = self._config
        if not self._candidates:
            return Silence.NO_COALITION, Trigger.NONE

        silent_ticks = math.inf
        if self._broadcast_ns is not None:
            silent_ticks = _ticks(self._now_ns - self._broadcast_ns)
        if silent_ticks < config.refractory_ticks:
            return Silence.REFRACTORY, Trigger.NONE

        activations = [candidate.activation for candidate in self._candidates.values()]
        old_ticks = _ticks(self._now_ns - self._new_ns)
        conditions = {
            Trigger.ONE_COALITION: max(activations) > config.coalition_above,
            Trigger.AGGREGATE: sum(activations) > config.aggregate_above,
            Trigger.NO_BROADCAST: silent_ticks >= config.no_broadcast_ticks,
            Trigger.NO_NEW_COALITION: old_ticks >= NO_NEW_COALITION_TICKS,
        }
        for trigger, is_met in conditions.items():
            if is_met:
                return Silence.NONE, trigger
        return Silence.NO_TRIGGER, Trigger.NONE


def _ticks(duration_ns: int) -> float:
    return duration_ns / 1e6 / TICK_MS


def build(config: Config, instance: str) -> Module:
    """Build the module `global_workspace`."""
    workspace = GlobalWorkspace(config)
    return Module("global_workspace", instance).on(
        topics.COALITIONS,
        workspace.on_coalitions,
        emits=[topics.COMPETITION, topics.BROADCAST],
    )
