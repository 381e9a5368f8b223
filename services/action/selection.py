"""Action selection: one behaviour is chosen once it is active enough (LIDA). Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import msgspec

from cogmap.schemas.cognition import Action, Behaviour, Rejection


class Level(NamedTuple):
    """How active a behaviour is. `activation` may be above 1 here, where several are: messages
    have it from 0 to 1. `gathered` is the part of it that came from other behaviours.
    """

    behaviour: Behaviour
    activation: float
    gathered: float = 0.0

    @property
    def is_executable(self) -> bool:
        """Return whether the scheme is instantiated."""
        return not self.behaviour.rejection

    @property
    def rank(self) -> tuple[float, float, str]:
        """Return the key that orders behaviours; the first is chosen."""
        return -self.activation, -self.behaviour.reliability, self.behaviour.scheme

    def as_considered(self) -> Behaviour:
        """Return the behaviour with this activation, for the message."""
        activation = min(1.0, max(0.0, self.activation)) if self.is_executable else 0.0
        return msgspec.structs.replace(
            self.behaviour, activation=activation, gathered=self.gathered
        )


class Selector(Protocol):
    """A rule by which behaviours become active."""

    def levels(self, behaviours: Sequence[Behaviour]) -> list[Level]:
        """Compute how active each of the behaviours of a broadcast is, in their order."""

    def on_chosen(self, behaviour: Behaviour) -> None:
        """Note that this behaviour was chosen."""

    def restore(self, behaviours: Sequence[Behaviour]) -> None:
        """Continue from what was considered last."""


class MostActive:
    """A behaviour is as active as the broadcast has made its scheme."""

    def levels(self, behaviours: Sequence[Behaviour]) -> list[Level]:
        """Compute how active each of the behaviours of a broadcast is, in their order."""
        return [Level(each, each.activation) for each in behaviours]

    def on_chosen(self, behaviour: Behaviour) -> None:
        """Do nothing: the next broadcast begins anew."""

    def restore(self, behaviours: Sequence[Behaviour]) -> None:
        """Do nothing, for nothing is kept."""


@dataclass(frozen=True)
class Selection:
    """The behaviour that was chosen, None if none was active enough, all that were considered,
    the chosen one included, and the threshold of the next selection.
    """

    chosen: Behaviour | None
    considered: list[Behaviour]
    threshold: float


class ActionSelection:
    """Chooses the most active behaviour over a threshold, which falls with each attempt that
    chooses none. Of equally active ones it is the most reliable, then the first by name.
    """

    def __init__(self, selector: Selector, threshold: float, fall: float) -> None:
        self._selector = selector
        self._first_threshold = threshold
        self._threshold = threshold
        self._fall = fall

    def restore(self, action: Action) -> None:
        """Continue from the selection that was published last."""
        self._threshold = action.threshold
        self._selector.restore(action.behaviours)

    def select(self, behaviours: Sequence[Behaviour]) -> Selection:
        """Choose the behaviour for a broadcast, by those of it that are instantiated."""
        levels = self._selector.levels(behaviours)
        executable = [level for level in levels if level.is_executable]
        best = min(executable, key=lambda level: level.rank, default=None)
        if best is None or best.activation < self._threshold:
            self._threshold = max(0.0, self._threshold - self._fall)
            return Selection(None, _rejected(levels, Rejection.BELOW_THRESHOLD), self._threshold)

        self._threshold = self._first_threshold
        self._selector.on_chosen(best.behaviour)
        considered = _rejected(levels, Rejection.LESS_ACTIVE, best)
        return Selection(best.as_considered(), considered, self._threshold)


def _rejected(
    levels: Sequence[Level], reason: Rejection, best: Level | None = None
) -> list[Behaviour]:
    """Return the behaviours, rejected if they were instantiated and are not the best."""
    considered = []
    for level in levels:
        behaviour = level.as_considered()
        if level.is_executable and level is not best:
            behaviour = msgspec.structs.replace(behaviour, rejection=reason)
        considered.append(behaviour)

    return considered
