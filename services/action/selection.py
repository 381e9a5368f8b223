"""Procedural memory and action selection: schemes become behaviours, one behaviour is chosen (LIDA;
Maes 1989).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import msgspec

from schemas.cognition import Behaviour, Rejection
from schemas.nodes import GraphNode, Self, kind_name, kind_of
from services.action.config import Config

Context = dict[str, float]

FOLLOW_ROUTE = "follow_route"
HALT = "halt"


@dataclass
class Scheme:
    """Percepts that call for an action, and the expected results of the action, by salience."""

    name: str
    context: tuple[str, ...]
    adding: dict[str, float] = field(default_factory=dict)

    def is_applicable(self, context: Context) -> bool:
        """Whether every part of the scheme's context is active."""
        return all(context.get(part, 0.0) > 0.0 for part in self.context)

    def activation(self, context: Context) -> float:
        """min(1, mean context + mean |adding-list salience|), 0 where it is not applicable."""
        if not self.is_applicable(context):
            return 0.0

        activations = [context[part] for part in self.context]
        mean_context = sum(activations) / len(activations)

        saliences = [abs(salience) for salience in self.adding.values()]
        mean_adding = sum(saliences) / max(1, len(saliences))

        return min(1.0, mean_context + mean_adding)


def procedural_memory() -> list[Scheme]:
    """The schemes. Following the route needs a self node; the end of the route calls for a halt."""
    return [
        Scheme(FOLLOW_ROUTE, context=(kind_name(Self), "route_ahead"), adding={"further": 0.2}),
        Scheme(HALT, context=("route_end",), adding={"rest": 0.3}),
    ]


@dataclass(frozen=True)
class Selection:
    """The behaviour that was chosen, and all that were considered, the chosen one included."""

    chosen: Behaviour
    considered: list[Behaviour]


class ActionSelection:
    """Chooses the most active behaviour over a threshold, which falls with each attempt that
    chooses none.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        self._schemes = procedural_memory()
        self._threshold = config.selection_threshold

    def select(self, content: Sequence[GraphNode], route: Context) -> Selection | None:
        """The behaviour for a broadcast's content and the route's state; None where none is active
        enough.
        """
        context = _context(content, route)
        considered = [self._behaviour(scheme, context) for scheme in self._schemes]

        instantiated = [each for each in considered if not each.rejection]
        best = max(instantiated, key=lambda each: each.activation, default=None)
        if best is None or best.activation < self._threshold:
            self._threshold = max(0.0, self._threshold - self._config.threshold_fall)
            return None

        self._threshold = self._config.selection_threshold
        return Selection(best, [_compared(each, best) for each in considered])

    def _behaviour(self, scheme: Scheme, context: Context) -> Behaviour:
        activation = scheme.activation(context)
        rejection = Rejection.NONE

        if not scheme.is_applicable(context):
            rejection = Rejection.CONTEXT_MISSING
        elif activation < self._config.instantiation:
            rejection = Rejection.NOT_INSTANTIATED

        return Behaviour(scheme=scheme.name, activation=activation, rejection=rejection)


def _compared(behaviour: Behaviour, chosen: Behaviour) -> Behaviour:
    """A behaviour, rejected where it was instantiated and another was chosen."""
    if behaviour is chosen or behaviour.rejection:
        return behaviour
    return msgspec.structs.replace(behaviour, rejection=Rejection.LESS_ACTIVE)


def _context(content: Sequence[GraphNode], route: Context) -> Context:
    """The activation of each kind of node, that of its most active node, and the route's state."""
    context = dict(route)
    for node in content:
        activation = min(1.0, node.base_level + node.activation)
        kind = kind_of(node)
        context[kind] = max(context.get(kind, 0.0), activation)

    return context
