"""Procedural memory and action selection: schemes become behaviours, one behaviour wins (LIDA; Maes
1989).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from schemas.graph import Node
from services.action.config import Config


@dataclass
class Scheme:
    """Percepts that call for an action, and what the action is expected to bring about, by
    salience.
    """

    name: str
    context: tuple[str, ...]
    adding: dict[str, float] = field(default_factory=dict)

    def activation(self, context: dict[str, float]) -> float:
        """min(1, mean context + mean |adding-list salience|); 0 where a part of the context is
        missing.
        """
        if any(context.get(part, 0.0) <= 0.0 for part in self.context):
            return 0.0
        mean_context = sum(context[part] for part in self.context) / len(self.context)
        mean_adding = sum(abs(salience) for salience in self.adding.values()) / max(
            1, len(self.adding)
        )
        return min(1.0, mean_context + mean_adding)


FOLLOW_ROUTE = "follow_route"
HALT = "halt"


def procedural_memory() -> list[Scheme]:
    """The schemes there are. Following the route needs to know where the agent is; its end calls
    for a halt.
    """
    return [
        Scheme(FOLLOW_ROUTE, context=("self", "route_ahead"), adding={"further": 0.2}),
        Scheme(HALT, context=("route_end",), adding={"rest": 0.3}),
    ]


class ActionSelection:
    """Picks the most active behaviour over a threshold that falls with each attempt that selects
    none.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        self._schemes = procedural_memory()
        self._threshold = config.selection_threshold

    def select(self, content: list[Node], route: dict[str, float]) -> tuple[Scheme, float] | None:
        """The scheme to execute, given a broadcast's content and how far the route goes on; None
        where none is ripe.
        """
        context = dict(route)
        for node in content:
            context[node.kind] = max(
                context.get(node.kind, 0.0), min(1.0, node.base_level + node.activation)
            )
        behaviours = [(scheme, scheme.activation(context)) for scheme in self._schemes]
        ripe = [behaviour for behaviour in behaviours if behaviour[1] >= self._config.instantiation]
        best = max(ripe, key=lambda behaviour: behaviour[1], default=None)
        if best is None or best[1] < self._threshold:
            self._threshold = max(0.0, self._threshold - self._config.threshold_fall)
            return None
        self._threshold = self._config.selection_threshold
        return best
