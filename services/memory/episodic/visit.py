"""An episode that lasts: what is broadcast at one place. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.memory import TransientEpisode
from cogmap.schemas.nodes import (
    AnyNode,
    Goal,
    Need,
    Node,
    Object,
    Remembered,
    goal_id,
    kind_of,
)
from cogmap.services.memory.episodic.encoding import PLACE_M

Name = tuple[str, str]
Position = tuple[float, float]
MAX_CONTENT = 10
"""So many nodes an episode has at most: its vector has room for them beside place and path."""


@dataclass
class Visit:
    """The broadcasts at one place since the agent came there, one at least.

    `activation` is the first coalition's, and rises with each further broadcast.
    """

    number: int
    at_m: Position
    path: list[Position]
    from_ns: int
    until_ns: int
    activation: float
    _counts: dict[Name, int] = field(default_factory=dict)
    _saliences: dict[Name, float] = field(default_factory=dict)

    @property
    def has_content(self) -> bool:
        """Return whether anything but the agent itself was conscious here."""
        return bool(self._counts)

    def includes(self, at_m: Position) -> bool:
        """Decide whether the agent at `at_m` is still at this place."""
        return math.dist(at_m, self.at_m) <= PLACE_M

    def add(self, broadcast: Broadcast) -> None:
        """Take in what a broadcast is about."""
        self.until_ns = max(self.from_ns, broadcast.stamp_ns)
        for node in broadcast.coalition.nodes:
            name = name_of(node)
            if name is None:
                continue

            self._counts[name] = self._counts.get(name, 0) + 1
            felt = self._saliences.get(name, 0.0)
            self._saliences[name] = max(felt, node.salience, key=abs)

    def reinforce(self, amount: float) -> None:
        """Raise its activation, to 1 at most."""
        self.activation = min(1.0, self.activation + amount)

    def episode(self, run: int, map_name: str) -> TransientEpisode:
        """Make the episode so far. Its content is the most salient nodes, and of equal ones those
        that were broadcast most often.
        """

        def order(name: Name) -> tuple[float, int, Name]:
            return -abs(self._saliences[name]), -self._counts[name], name

        content = []
        for name in sorted(self._counts, key=order)[:MAX_CONTENT]:
            kind, label = name
            felt = self._saliences[name]
            content.append(Remembered(kind=kind, label=label, salience=felt))

        x_m, y_m = self.at_m
        return TransientEpisode(
            number=self.number,
            run=run,
            map=map_name,
            x_m=x_m,
            y_m=y_m,
            from_ns=self.from_ns,
            until_ns=self.until_ns,
            content=content,
            path=self.path,
            activation=self.activation,
            active_ns=self.until_ns,
        )


def name_of(node: AnyNode) -> Name | None:
    """Return the kind of a node and its name in episodes; None for a node that is in none, such as
    the self, which is in all.
    """
    match node:
        case Object():
            return kind_of(node), node.look or node.label
        case Need(label=label):
            return kind_of(node), label
        case Goal(object=label):
            return kind_of(node), label or node.id.removeprefix(goal_id(""))
        case Node():
            return node.kind, node.id
        case _:
            return None
