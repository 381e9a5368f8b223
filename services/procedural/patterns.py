"""Patterns of nodes: what a scheme's context and its results are made of. Pure."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from cogmap.schemas.base import Scalar
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.nodes import GraphNode, Node, kind_of

Bindings = Mapping[str, str]


class Active(NamedTuple):
    """A node, its total activation, and what is felt about it, where it is conscious."""

    node: GraphNode
    activation: float
    feeling: Feeling = Feeling.NONE


@dataclass(frozen=True)
class Condition:
    """What a field of a node must be: one of `values` where there are any, and a number from
    `at_least` to `at_most` where these are given.
    """

    field: str
    values: tuple[Scalar, ...] = ()
    at_least: float | None = None
    at_most: float | None = None

    def holds(self, node: GraphNode) -> bool:
        """Decide whether a node fulfils the condition. A node without the field does not."""
        value = value_of(node, self.field)
        if value is None:
            return False
        if self.values and value not in self.values:
            return False
        if self.at_least is None and self.at_most is None:
            return True
        if not isinstance(value, int | float):
            return False

        is_enough = self.at_least is None or value >= self.at_least
        is_little = self.at_most is None or value <= self.at_most
        return is_enough and is_little

    def __str__(self) -> str:
        words = []
        for value in self.values:
            words.append(value.name.lower() if isinstance(value, enum.Enum) else str(value))

        text = f"={'|'.join(words)}" if words else ""
        if self.at_least is not None:
            text += f">={self.at_least:g}"
        if self.at_most is not None:
            text += f"<={self.at_most:g}"
        return self.field + text


@dataclass(frozen=True)
class Pattern:
    """Nodes of a kind of which conditions hold. If it has a `variable`, that stands for the id
    of the node that matches, in all patterns of a scheme. If it has `feelings`, the node is
    broadcast with one of them.
    """

    kind: str
    conditions: tuple[Condition, ...] = ()
    variable: str = ""
    feelings: tuple[Feeling, ...] = ()

    def match(self, nodes: Iterable[Active], bindings: Bindings) -> Active | None:
        """Find the most active node that matches, of equals the first by id; None if none does."""
        wanted = bindings.get(self.variable)
        found = []
        for active in nodes:
            node = active.node
            if kind_of(node) != self.kind or (wanted is not None and node.id != wanted):
                continue
            if self.feelings and active.feeling not in self.feelings:
                continue
            if all(condition.holds(node) for condition in self.conditions):
                found.append(active)

        return min(found, key=lambda each: (-each.activation, each.node.id), default=None)

    def spelled(self, bindings: Bindings) -> str:
        """Spell the pattern in words, with the id of the node that its variable stands for."""
        words = [self.kind]
        bound = bindings.get(self.variable)
        if bound is not None:
            words.append(f"id={bound}")
        words += [str(condition) for condition in self.conditions]
        if self.feelings:
            words.append(str(Condition("feeling", self.feelings)))
        return " ".join(words)


def value_of(node: GraphNode, field: str) -> Scalar | None:
    """Return a field of a node, or an attribute of a node of a kind that is not known here; None if
    it has none that is a scalar.
    """
    if isinstance(node, Node) and field in node.attributes:
        return node.attributes[field]

    value = getattr(node, field, None)
    return value if isinstance(value, bool | int | float | str) else None
