"""Relations between objects: what stands next to another, on the left or right as the agent sees
them. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import NamedTuple

from cogmap.schemas.cognition import Relation
from cogmap.schemas.nodes import Side, object_id, relation_id


def related(relations: Iterable[Relation]) -> dict[str, str]:
    """The relations between objects that stand to the agent so, each with the PAM node of the
    object that stands in it.
    """
    from_left = sorted(relations, key=lambda each: (-each.bearing_rad, each.range_m))

    standing = {}
    for left, right in pairwise(from_left):
        standing[relation_id(Side.LEFT_OF, right.look)] = object_id(left.look)
        standing[relation_id(Side.RIGHT_OF, left.look)] = object_id(right.look)

    return standing


class Seen(NamedTuple):
    """The column of a view at which something named is seen, and the evidence that it is that."""

    column: float
    evidence: float


def beside(column: float, named: Mapping[str, Seen]) -> dict[str, float]:
    """The relations in which something stands that is seen at `column`, each with its activation:
    next to the nearest on either side of what was `named` in the view.
    """
    on_left = [(seen.column, look) for look, seen in named.items() if seen.column <= column]
    on_right = [(seen.column, look) for look, seen in named.items() if seen.column > column]

    standing = {}
    if on_left:
        _, look = max(on_left)
        standing[relation_id(Side.RIGHT_OF, look)] = named[look].evidence
    if on_right:
        _, look = min(on_right)
        standing[relation_id(Side.LEFT_OF, look)] = named[look].evidence

    return standing
