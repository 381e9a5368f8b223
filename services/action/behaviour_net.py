"""The behaviour net: behaviours excite and inhibit each other (Maes 1989, as in LIDA). Pure.

A behaviour is as active as the broadcast has made its scheme, and by what it has gathered. With
each broadcast it gathers from its context, from those whose results it needs or brings about, and
loses to those whose context it would undo. Patterns are the same where they are spelled the same.
"""

from __future__ import annotations

from collections.abc import Sequence

from cogmap.schemas.cognition import Behaviour
from cogmap.services.action.config import Config
from cogmap.services.action.selection import Level

Key = tuple[str, tuple[tuple[str, str], ...]]


class BehaviourNet:
    """The activation that each behaviour has gathered, from broadcast to broadcast."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._gathered: dict[Key, float] = {}

    def restore(self, behaviours: Sequence[Behaviour]) -> None:
        """Continue from what was considered last. The one that was chosen has gathered nothing."""
        for behaviour in behaviours:
            chosen = not behaviour.rejection
            self._gathered[_key(behaviour)] = 0.0 if chosen else behaviour.gathered

    def on_chosen(self, behaviour: Behaviour) -> None:
        """The behaviour that was chosen begins to gather anew."""
        self._gathered[_key(behaviour)] = 0.0

    def levels(self, behaviours: Sequence[Behaviour]) -> list[Level]:
        """How active each of the behaviours of a broadcast is, in their order.

        All pass activation at once, by what they had before. One that is not instantiated is as
        active, to the others, as its results are wanted.
        """
        before = [self._before(behaviour) for behaviour in behaviours]
        self._gathered = {}
        levels = []
        for level in before:
            gathered = level.gathered + self._from_broadcast(level.behaviour)
            gathered += sum(self._passed(other, level) for other in before if other is not level)
            self._gathered[_key(level.behaviour)] = gathered
            own = level.activation - level.gathered
            levels.append(Level(level.behaviour, own + gathered, gathered))

        return levels

    def _before(self, behaviour: Behaviour) -> Level:
        """A behaviour as it enters: with what is left of what it had gathered."""
        had = self._gathered.get(_key(behaviour), 0.0)
        decay = self._config.net_decay
        left = max(0.0, had - decay) if had > 0.0 else min(0.0, had + decay)
        own = _wanted(behaviour) if behaviour.rejection else behaviour.activation
        return Level(behaviour, own + left, left)

    def _from_broadcast(self, behaviour: Behaviour) -> float:
        context = behaviour.context.values()
        mean = sum(context) / max(1, len(context))
        return self._config.broadcast_excitation * mean

    def _passed(self, source: Level, target: Level) -> float:
        """The activation that one behaviour passes to another, below 0 where it inhibits it."""
        activation = max(0.0, source.activation)
        config = self._config
        share = -config.conflictor_inhibition * self._conflict(source, target)
        if source.is_executable:
            share += config.successor_excitation * _enabled(source.behaviour, target.behaviour)
        else:
            share += config.predecessor_excitation * _enabled(target.behaviour, source.behaviour)
        return share * activation

    def _conflict(self, source: Level, target: Level) -> float:
        """The share of the source's context that the target undoes. Of two that would undo each
        other's, only the more active one inhibits.
        """
        undone = _undone(target.behaviour, source.behaviour)
        is_mutual = _undone(source.behaviour, target.behaviour) > 0.0
        if is_mutual and source.activation < target.activation:
            return 0.0
        return undone


def _key(behaviour: Behaviour) -> Key:
    return behaviour.scheme, tuple(sorted(behaviour.bindings.items()))


def _wanted(behaviour: Behaviour) -> float:
    """The mean |salience| of what a behaviour brings about."""
    saliences = [abs(salience) for salience in behaviour.adding.values()]
    return sum(saliences) / max(1, len(saliences))


def _enabled(first: Behaviour, then: Behaviour) -> float:
    """The share of a behaviour's context that is missing, and that another one brings about."""
    brought = [each for each in then.context if then.context[each] <= 0.0 and each in first.adding]
    return len(brought) / max(1, len(then.context))


def _undone(undoing: Behaviour, undone: Behaviour) -> float:
    """The share of a behaviour's context that is there, and that another one takes away."""
    context = undone.context
    taken = [each for each in undoing.deleting if context.get(each, 0.0) > 0.0]
    return len(taken) / max(1, len(context))
