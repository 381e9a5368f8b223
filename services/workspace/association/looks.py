"""How many of the objects of the map a percept looks like. Pure."""

from __future__ import annotations

from typing import NamedTuple

from cogmap.graph.likeness import P_NAME, distribution, likeness, odds
from cogmap.schemas.nodes import Object
from cogmap.schemas.sensing import Percept
from cogmap.services.workspace.association.known_objects import KnownObjects

ALIKE = 3.0
"""A percept so many times likelier of an object than of any, by its look, looks like it."""

SURVEYED_ALONE = 1e-6
"""How likely another object has the name of one that was given with its place: hardly."""


class Look(NamedTuple):
    """How a percept looks, beside the objects of the map.

    `of_any` is how much likelier it looks so if it is of any object of the map, than if of anything
    in the world; `of_another` the same if it is of none, as far as the others tell which looks
    there are. `alike` is the object that it looks like most, None if it looks like none.
    """

    of_any: float
    of_another: float
    alike: Object | None


def look_of(percept: Percept, known: KnownObjects) -> Look:
    """Compare the look of a percept with those of all objects of the map.

    What another object looks like is what the objects but the one most alike look like, as if there
    were one more of any look.
    """
    if not len(known):
        return Look(1.0, 1.0, None)

    if percept.appearance is not None and known.has_appearances:
        nodes, cosines = known.alike(percept.appearance)
        ratios = [odds(cosine, percept.appearance) for cosine in cosines]
        others = len(known) - len(nodes)
        total = sum(ratios) + others
        best = max(range(len(nodes)), key=ratios.__getitem__)
        alike, highest = nodes[best], ratios[best]
    else:
        names = distribution(percept)
        total = len(known) * max(0.0, 1 - sum(names.values()))
        for name, probability in names.items():
            total += probability * known.count_called(name) / P_NAME

        alike, highest = None, 1.0
        for node in known.called(percept.name) if percept.name else ():
            ratio = likeness(percept, node)
            if ratio > highest:
                alike, highest = node, ratio

    of_another = max(total - highest, 0.0) + 1
    if alike is not None and alike.surveyed:
        of_another = SURVEYED_ALONE
    return Look(
        of_any=total / len(known),
        of_another=of_another / len(known),
        alike=alike if highest >= ALIKE else None,
    )
