"""Relations between objects: one stands next to another, on the left or right as the agent sees
them. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import NamedTuple

from cogmap.schemas.cognition import Relation
from cogmap.schemas.nodes import Side, name_id, relation_id


def related(relations: Iterable[Relation]) -> dict[str, str]:
    """Return the relations between objects in these `relations` to the agent, each with the PAM
    node of the object that stands in it.
    """
    named = [each for each in relations if each.look]
    from_left = sorted(named, key=lambda each: (-each.bearing_rad, each.range_m))

    standing = {}
    for left, right in pairwise(from_left):
        standing[relation_id(Side.LEFT_OF, right.look)] = name_id(left.look)
        standing[relation_id(Side.RIGHT_OF, left.look)] = name_id(right.look)

    return standing


class NamedObject(NamedTuple):
    """The column of a view at which a named object is seen, and the evidence for that name."""

    column: float
    evidence: float


def beside(column: float, named: Mapping[str, NamedObject]) -> dict[str, float]:
    """Return the relations in which an object at `column` stands to the nearest one on either side
    of those that are `named` in the view, by look, each with its activation.
    """
    on_left = [(each.column, look) for look, each in named.items() if each.column <= column]
    on_right = [(each.column, look) for look, each in named.items() if each.column > column]

    standing = {}
    if on_left:
        _, look = max(on_left)
        standing[relation_id(Side.RIGHT_OF, look)] = named[look].evidence
    if on_right:
        _, look = min(on_right)
        standing[relation_id(Side.LEFT_OF, look)] = named[look].evidence

    return standing
