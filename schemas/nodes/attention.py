"""What the agent needs, and what its attention keeps from cycle to cycle."""

from __future__ import annotations

from cogmap.schemas.base import Count, Name, Unit
from cogmap.schemas.nodes.base import GraphNode

ENERGY = "energy"
"""The label of the need of a body that has a battery."""

SATISFIED_BY = {ENERGY: "charge"}
"""The function of the objects that satisfy a need, by its label."""


class Need(GraphNode, kw_only=True, frozen=True, tag="need"):
    """A feeling of the body, such as the need of energy: `level` is how strong the need is, from 0,
    satisfied, to 1. It `is_eased` while it falls, as while the body is charged.
    """

    label: Name
    level: Unit
    is_eased: bool = False


class Attention(GraphNode, kw_only=True, frozen=True, tag="attention"):
    """What attention codelet `codelet` keeps from cycle to cycle.

    `brought_cycle` is the cycle in which it brought its last coalition, `conscious_cycle` that in
    which one of its coalitions was broadcast last, both 0 before. `pending` has what it is still to
    make conscious, by id, with the cycle in which it was brought last, 0 before. `noted` is what it
    has counted or seen already, by id; what the numbers mean is the codelet's own. `glimpsed` is
    what it has seen once and is to see again before it counts, by id, with the cycle.
    """

    codelet: Name
    brought_cycle: Count = 0
    conscious_cycle: Count = 0
    pending: dict[Name, Count] = {}
    noted: dict[Name, Count] = {}
    glimpsed: dict[Name, Count] = {}
