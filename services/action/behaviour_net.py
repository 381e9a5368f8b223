"""The behaviour net: behaviours excite and inhibit each other (Maes 1989, as in LIDA). Pure.

A behaviour is as active as the broadcast has made its scheme, and by what it has gathered. With
each broadcast it gathers from its context, from those whose results it needs or brings about, and
loses to those whose context it would undo. Patterns are the same if they are spelled the same.
"""

from __future__ import annotations

from collections.abc import Sequence

from cogmap.schemas.cognition import Behaviour
from cogmap.services.action.selection import Level

# LIDA's published defaults, as shares of an activation.
BROADCAST_EXCITATION = 0.05
"""What a behaviour gathers from a broadcast of its context."""
SUCCESSOR_EXCITATION = 0.04
"""What a behaviour passes to those whose missing context its results are."""
PREDECESSOR_EXCITATION = 0.1
"""What a behaviour whose context is missing passes to those that bring it about."""
CONFLICTOR_INHIBITION = 0.04
"""By what a behaviour inhibits those that undo its context."""
DECAY = 0.1
"""What is lost of what was gathered, with each broadcast. LIDA: in each tick; but behaviours gather
once in a broadcast, and by the tick nothing would last to the next.
"""

Key = tuple[str, tuple[tuple[str, str], ...]]


class BehaviourNet:
    """The activation that each behaviour has gathered, from broadcast to broadcast."""

    def __init__(self) -> None:
        self._gathered: dict[Key, float] = {}

    def restore(self, behaviours: Sequence[Behaviour]) -> None:
        """Continue from what was considered last. The one that was chosen has gathered nothing."""
        for behaviour in behaviours:
            chosen = not behaviour.rejection
            self._gathered[_key(behaviour)] = 0.0 if chosen else behaviour.gathered

    def on_chosen(self, behaviour: Behaviour) -> None:
        """Let the behaviour that was chosen begin to gather anew."""
        self._gathered[_key(behaviour)] = 0.0

    def levels(self, behaviours: Sequence[Behaviour]) -> list[Level]:
        """Compute how active each of the behaviours of a broadcast is, in their order.

        All pass activation at once, by what they had before. One that is not instantiated is as
        active, to the others, as its results are wanted: by their mean |salience|.
        """
        before = []
        for behaviour in behaviours:
            had = self._gathered.get(_key(behaviour), 0.0)
            left = max(0.0, had - DECAY) if had > 0.0 else min(0.0, had + DECAY)
            own = behaviour.activation
            if behaviour.rejection:
                saliences = [abs(salience) for salience in behaviour.adding.values()]
                own = sum(saliences) / max(1, len(saliences))
            before.append(Level(behaviour, own + left, left))

        self._gathered = {}
        levels = []
        for level in before:
            context = level.behaviour.context.values()
            gathered = level.gathered
            gathered += BROADCAST_EXCITATION * (sum(context) / max(1, len(context)))
            gathered += sum(passed(other, level) for other in before if other is not level)
            self._gathered[_key(level.behaviour)] = gathered
            own = level.activation - level.gathered
            levels.append(Level(level.behaviour, own + gathered, gathered))

        return levels


def passed(source: Level, target: Level) -> float:
    """Compute the activation that one behaviour passes to another, below 0 if it inhibits it.

    Of two that would undo each other's context only the more active one inhibits.
    """
    undone = _undone(target.behaviour, source.behaviour)
    is_mutual = _undone(source.behaviour, target.behaviour) > 0.0
    if is_mutual and source.activation < target.activation:
        undone = 0.0

    share = -CONFLICTOR_INHIBITION * undone
    if source.is_executable:
        share += SUCCESSOR_EXCITATION * _enabled(source.behaviour, target.behaviour)
    else:
        share += PREDECESSOR_EXCITATION * _enabled(target.behaviour, source.behaviour)
    return share * max(0.0, source.activation)


def _key(behaviour: Behaviour) -> Key:
    return behaviour.scheme, tuple(sorted(behaviour.bindings.items()))


def _enabled(first: Behaviour, then: Behaviour) -> float:
    """Compute the share of the context of `then` that is missing, and that `first` brings about."""
    brought = [each for each in then.context if then.context[each] <= 0.0 and each in first.adding]
    return len(brought) / max(1, len(then.context))


def _undone(undoing: Behaviour, undone: Behaviour) -> float:
    """Compute the share of the context of `undone` that is there, and that `undoing` takes away."""
    context = undone.context
    taken = [each for each in undoing.deleting if context.get(each, 0.0) > 0.0]
    return len(taken) / max(1, len(context))
