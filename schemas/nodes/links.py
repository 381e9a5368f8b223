"""The kinds of links, and which of them a node has one of."""

from __future__ import annotations

import enum


class LinkKind(enum.StrEnum):
    """The kinds of links that the architecture itself uses; a codelet may use others.

    AT: from the self, an object or a goal to the place node nearest to it. INSTANCE: from a percept
    to the object that it is a sighting of. OBSERVES and ALONG: from observations to the object
    observed, and to the path segment that they were made along. NEXT: between neighbouring place
    nodes; these are kept in the tiles' columns. TOWARDS: from a plan to its next goal. WITHIN: from
    an object to the sub-map that holds it. BLOCKED: to a place node where what stands there closes
    a road, from the plan whose route leads there, or from the self, which drove there before.
    """

    AT = "at"
    INSTANCE = "instance"
    OBSERVES = "observes"
    ALONG = "along"
    NEXT = "next"
    TOWARDS = "towards"
    WITHIN = "within"
    BLOCKED = "blocked"


EXCLUSIVE_LINKS = frozenset(
    {
        LinkKind.AT,
        LinkKind.INSTANCE,
        LinkKind.OBSERVES,
        LinkKind.ALONG,
        LinkKind.TOWARDS,
        LinkKind.WITHIN,
    }
)
"""Kinds of which a node has one link: a new one replaces it."""
