"""The settings of route planning and exploration."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from cogmap.schemas.base import PositiveMetres, PositiveSeconds, Share

SECTION = "planning"


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How routes are planned, and where the agent explores."""

    planning: Annotated[
        Literal["gradient", "hierarchy"],
        Meta(
            description="How routes are found (paper 5.5). gradient: on the finest map that has "
            "start and goal, from neighbour to neighbour up the activation that spreads from the "
            "goal; of several goals always to the nearest (figure 5 A-C). hierarchy: on coarse "
            "maps first, goals in an order that makes the tour short (figure 5 D), and lines "
            "straightened."
        ),
    ] = "hierarchy"
    explore: Annotated[
        bool,
        Meta(description="Explore while there is no goal, or none with a route."),
    ] = False
    reached_m: Annotated[
        PositiveMetres, Meta(description="Distance at which a goal counts as reached, in m.")
    ] = 2.0
    satisfied_level: Annotated[
        Share, Meta(description="Level at which a need counts as satisfied.")
    ] = 0.1
    approach_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance from an object within which the agent is at it, in m: its goal "
            "is the nearest free place."
        ),
    ] = 20.0
    unknown_cost: Annotated[
        float,
        Meta(
            ge=1,
            le=1000,
            description="Cost of places never seen as road, as a factor on their length.",
        ),
    ] = 10.0
    reopens_after_s: Annotated[
        PositiveSeconds,
        Meta(description="Time after which road that was seen to be blocked may be free, in s."),
    ] = 600.0
    search_places: Annotated[
        int,
        Meta(
            ge=0,
            le=2**31,
            description="Places of a map that are searched at once; routes over larger maps are "
            "found on coarser ones first.",
        ),
    ] = 250_000
    replan_cycles: Annotated[
        int, Meta(ge=1, le=10_000, description="Cycles between two plans of an unchanged goal.")
    ] = 5
