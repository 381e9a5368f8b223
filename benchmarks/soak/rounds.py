"""Sends the agent round its goals again and again, and notes when each command came."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence

import msgspec

from cogmap.bus.interface import Arrival
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Delta, DropNode, Operation
from cogmap.schemas.nodes import NEVER_NS, Goal, goal_id

PATIENCE_CYCLES = 100
"""An offer that is not in the graph after so many was lost: it is made again."""


def next_round(goals: Sequence[Goal], number: int) -> list[Operation]:
    """Drop `goals` and give them anew, in their order, under the names of round `number`."""
    names = {goal.id: goal_id(f"round-{number}-{place}") for place, goal in enumerate(goals)}
    dropped = [DropNode(id=goal.id) for goal in goals]
    given = []
    for goal in goals:
        again = msgspec.structs.replace(
            goal,
            id=names[goal.id],
            after=names.get(goal.after, ""),
            reached_ns=NEVER_NS,
        )
        given.append(again)

    return [*dropped, *given]


class Rounds:
    """Offers the goals that the agent has again when it has reached all of them. `number` is how
    many rounds began after the first.
    """

    def __init__(self) -> None:
        self.graph = Graph()
        self.number = 0
        self._offered_cycle: int | None = None
        self.module = Module("soak", f"soak-{os.getpid()}").following(
            self.graph,
            self.on_delta,
            emits=[topics.OFFER],
        )

    def on_delta(self, delta: Delta) -> list[Message]:
        """Offer the next round once this one is over, and again if the offer was lost."""
        goals = list(self.graph.of_kind(Goal))
        if not goals or any(goal.reached_ns == NEVER_NS for goal in goals):
            self._offered_cycle = None
            return []

        offered = self._offered_cycle
        if offered is not None and self.graph.cycle - offered < PATIENCE_CYCLES:
            return []

        self.number += offered is None
        self._offered_cycle = self.graph.cycle
        return [Offer(cycle=self.graph.cycle, operations=next_round(goals, self.number))]


class Cycles:
    """When each motor command came, in s on the monotonic clock, and how long before that the
    camera frame was stamped which it answers, in ms.
    """

    def __init__(self) -> None:
        self.at_s: list[float] = []
        self.cycle_ms: list[float] = []

    def on_command(self, arrival: Arrival) -> None:
        """Note a command as it arrives."""
        if arrival.envelope is None:
            return

        self.at_s.append(time.monotonic())
        self.cycle_ms.append((arrival.received_ns - arrival.envelope.born_ns) / 1e6)
