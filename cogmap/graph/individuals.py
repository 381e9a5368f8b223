"""Individual objects that look alike, and where another one of them cannot stand."""

from __future__ import annotations

import math
from collections.abc import Iterable

from cogmap.schemas.nodes import Object, look_of

APART_M = 6.0
"""Buildings stand at least so far from one another."""


def is_same(one: Object, other: Object) -> bool:
    """Return true if two objects of one map, which look alike, stand where only one of them can."""
    if look_of(one.label) != look_of(other.label) or one.map != other.map:
        return False
    return math.dist((one.x_m, one.y_m), (other.x_m, other.y_m)) <= APART_M


def is_among(node: Object, others: Iterable[Object]) -> bool:
    """Return true if an object is the same as one of some others."""
    return any(is_same(node, other) for other in others)
