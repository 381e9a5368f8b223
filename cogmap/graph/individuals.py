"""Two objects that are one individual: they look alike, and stand where only one of them can."""

from __future__ import annotations

import math
from collections.abc import Iterable

from cogmap.graph.graph import Graph
from cogmap.graph.likeness import name_ratio
from cogmap.schemas.nodes import Object, object_id

OVERLAP = 0.5
"""Two objects do not stand nearer than such a share of the mean of their widths."""

SD = 2.0
"""Standard deviations of where two objects are known to stand within which they may be one."""


def is_same(one: Object, other: Object) -> bool:
    """Return true if two objects of one map look alike, as far as they have names, and stand where
    only one of them can.
    """
    if one.map != other.map or name_ratio(shares(one), other.names) < 1.0:
        return False
    return math.dist((one.x_m, one.y_m), (other.x_m, other.y_m)) <= reach_m(one, other)


def reach_m(one: Object, other: Object) -> float:
    """Return the distance within which two objects may be one: their footprints overlap, or their
    places are not known any better.
    """
    sd_m = math.hypot(one.x_sd_m, one.y_sd_m, other.x_sd_m, other.y_sd_m)
    return max(OVERLAP * (one.width_m + other.width_m) / 2, SD * sd_m)


def called(name: str, graph: Graph) -> list[Object]:
    """Return the objects that somebody means by a name: the one of that label, or that a person
    calls so, or all that look so.
    """
    labelled = graph.get(Object, object_id(name))
    if labelled is not None:
        return [labelled]

    objects = list(graph.of_kind(Object))
    given = [node for node in objects if node.given_name == name]
    return given or [node for node in objects if node.look == name]


def near(name: str, graph: Graph, within_m: float) -> list[tuple[float, Object]]:
    """Return what stands within a distance of the objects that somebody means by a name, but these:
    each with its distance in metres from the nearest of them, the nearest first.
    """
    meant = called(name, graph)
    found = []
    for node in graph.of_kind(Object):
        if node in meant:
            continue

        away_m = [
            math.dist((node.x_m, node.y_m), (each.x_m, each.y_m))
            for each in meant
            if each.map == node.map
        ]
        if away_m and min(away_m) <= within_m:
            found.append((min(away_m), node))
    return sorted(found, key=lambda item: (item[0], item[1].label))


def shares(node: Object) -> dict[str, float]:
    """Return the share of each name in the evidence for all that an object may be called."""
    total = sum(node.names.values())
    return {name: evidence / total for name, evidence in node.names.items() if name and total}


def names_of_both(one: Object, other: Object) -> dict[str, float]:
    """Return the evidence for each name of two objects that are one."""
    names = {**one.names, **other.names}
    return {name: one.names.get(name, 0.0) + other.names.get(name, 0.0) for name in names}


def is_among(node: Object, others: Iterable[Object]) -> bool:
    """Return true if an object is the same as one of some others."""
    return any(is_same(node, other) for other in others)
