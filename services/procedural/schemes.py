"""Schemes: contexts that call for an action, and what that is expected to bring about (LIDA).

Pure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from cogmap.schemas.base import Scalar
from cogmap.schemas.cognition import Behaviour, Rejection
from cogmap.services.procedural.patterns import Active, Pattern, value_of


class Result(NamedTuple):
    """A pattern that an action is expected to make true, and how salient that is, -1 to 1."""

    pattern: Pattern
    salience: float


class Reference(NamedTuple):
    """A parameter that is a field of the node that a variable stands for."""

    variable: str
    field: str


@dataclass(frozen=True)
class Scheme:
    """A context, an action, its expected results, and what it makes untrue.

    `base_level` is its reliability before it was ever executed. A result has come true where it
    does so within `within_s` of the execution.
    """

    name: str
    action: str
    context: tuple[Pattern, ...]
    adding: tuple[Result, ...] = ()
    deleting: tuple[Pattern, ...] = ()
    parameters: Mapping[str, Scalar | Reference] = field(default_factory=dict)
    base_level: float = 0.5
    within_s: float = 5.0

    def activation(self, context: Sequence[float]) -> float:
        """Compute min(1, mean context + mean |adding-list salience|), 0 if part of the context is
        not active.
        """
        if not context or min(context) <= 0.0:
            return 0.0

        mean_context = sum(context) / len(context)
        saliences = [abs(result.salience) for result in self.adding]
        mean_adding = sum(saliences) / max(1, len(saliences))
        return min(1.0, mean_context + mean_adding)

    def considered(self, nodes: Sequence[Active], threshold: float) -> Behaviour:
        """Make the behaviour that nodes make of the scheme, rejected if part of its context is
        missing or it is less active than `threshold`.
        """
        # Each pattern takes the most active node that is left to it by the variables before.
        bindings: dict[str, str] = {}
        bound: dict[str, Active] = {}
        activations = []
        for pattern in self.context:
            active = pattern.match(nodes, bindings)
            activations.append(0.0 if active is None else active.activation)
            if active is not None and pattern.variable:
                bindings[pattern.variable] = active.node.id
                bound[pattern.variable] = active

        activation = self.activation(activations)
        rejection = Rejection.NONE
        if min(activations) <= 0.0:
            rejection = Rejection.CONTEXT_MISSING
        elif activation < threshold:
            rejection = Rejection.NOT_INSTANTIATED

        parameters: dict[str, Scalar] = {}
        for name, value in self.parameters.items():
            if not isinstance(value, Reference):
                parameters[name] = value
            elif value.variable in bound:
                found = value_of(bound[value.variable].node, value.field)
                if found is not None:
                    parameters[name] = found

        spelled = [pattern.spelled(bindings) for pattern in self.context]
        return Behaviour(
            scheme=self.name,
            activation=activation,
            rejection=rejection,
            action=self.action,
            bindings=bindings,
            parameters=parameters,
            context=dict(zip(spelled, activations, strict=True)),
            adding={each.pattern.spelled(bindings): each.salience for each in self.adding},
            deleting=[pattern.spelled(bindings) for pattern in self.deleting],
        )

    def has_come_true(self, nodes: Sequence[Active], bindings: Mapping[str, str]) -> bool:
        """Decide whether all that the action was expected to bring about is there."""
        return all(result.pattern.match(nodes, bindings) for result in self.adding)
