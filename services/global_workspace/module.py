"""The global workspace: coalitions compete for consciousness, and the winner is broadcast (LIDA's
framework).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from schemas import topics
from schemas.base import Message
from schemas.cognition import Broadcast, Coalition, Coalitions, Competition
from services.global_workspace.config import Config

__all__ = ["Config", "GlobalWorkspace", "build"]

REMEMBERED_CYCLES = 64


@dataclass
class Contender:
    """A coalition and what is left of its activation."""

    coalition: Coalition
    activation: float


class GlobalWorkspace:
    """Holds the contenders, one from each attention codelet, and decides when one is broadcast."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._contenders: dict[str, Contender] = {}
        self._stamp_ns = 0
        self._broadcast_ns: int | None = None
        self._new_ns = 0
        self._had: deque[tuple[int, int]] = deque(maxlen=REMEMBERED_CYCLES)

    def compete(self, coalitions: Coalitions) -> list[Message]:
        """Take in a cycle's coalitions; a competition is always reported, a broadcast where a
        trigger fires.

        Raises MessageError where they came before: a task that one worker lost is answered by two.
        """
        which = (coalitions.cycle, coalitions.stamp_ns)
        if which in self._had:
            raise MessageError(f"the coalitions of cycle {coalitions.cycle} came twice")
        self._had.append(which)
        self._decay(max(0, coalitions.stamp_ns - self._stamp_ns))
        self._stamp_ns = max(self._stamp_ns, coalitions.stamp_ns)
        for coalition in coalitions.coalitions:
            if coalition.codelet not in self._contenders:
                self._new_ns = self._stamp_ns
            self._contenders[coalition.codelet] = Contender(coalition, coalition.activation)
        contenders = {
            name: contender.activation for name, contender in sorted(self._contenders.items())
        }
        trigger = self._trigger()
        competition = Competition(
            stamp_ns=coalitions.stamp_ns,
            cycle=coalitions.cycle,
            contenders=contenders,
            trigger=trigger,
        )
        if not trigger:
            return [competition]
        winner = max(sorted(self._contenders), key=lambda name: self._contenders[name].activation)
        self._broadcast_ns = self._stamp_ns
        coalition = self._contenders.pop(winner).coalition
        broadcast = Broadcast(
            stamp_ns=coalitions.stamp_ns,
            cycle=coalitions.cycle,
            trigger=trigger,
            coalition=coalition,
        )
        return [broadcast, competition]

    def _decay(self, passed_ns: int) -> None:
        lost = self._config.decay * self._ticks(passed_ns) / self._config.ticks_per_decay
        for contender in self._contenders.values():
            contender.activation -= lost
        self._contenders = {
            name: left for name, left in self._contenders.items() if left.activation > 0
        }

    def _ticks(self, duration_ns: int) -> float:
        return duration_ns / 1e6 / self._config.tick_ms

    def _trigger(self) -> str:
        """The name of the first trigger that fires, empty where none does."""
        config = self._config
        activations = [contender.activation for contender in self._contenders.values()]
        if not activations:
            return ""
        silent = (
            math.inf
            if self._broadcast_ns is None
            else self._ticks(self._stamp_ns - self._broadcast_ns)
        )
        if silent < config.refractory_ticks:
            return ""
        triggers = {
            "one coalition over threshold": max(activations) > config.coalition_above,
            "aggregate activation over threshold": sum(activations) > config.aggregate_above,
            "no broadcast for long": silent >= config.no_broadcast_ticks,
            "no new coalition for long": self._ticks(self._stamp_ns - self._new_ns)
            >= config.no_new_coalition_ticks,
        }
        return next((name for name, fires in triggers.items() if fires), "")


def build(config: Config, instance: str) -> Module:
    """The module `global_workspace`."""
    return Module("global_workspace", instance).on(
        topics.COALITIONS,
        GlobalWorkspace(config).compete,
        emits=[topics.COMPETITION, topics.BROADCAST],
    )
