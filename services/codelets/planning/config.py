"""The settings of route planning and exploration."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from cogmap.schemas.base import PositiveMetres, PositiveSeconds, PositiveShare, Share

SECTION = "planning"

Cells = Annotated[int, Meta(ge=1, le=10_000)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How routes are planned, and where the agent explores."""

    replan_cycles: Annotated[
        Cells, Meta(description="Cycles between two plans of an unchanged goal, 1 to 10000.")
    ] = 5
    explore: Annotated[
        bool,
        Meta(description="Whether the agent explores while it has no goal, or none with a route."),
    ] = False
    reached_m: Annotated[
        PositiveMetres,
        Meta(description="Distance at which a goal counts as reached, in m, above 0 to 10000."),
    ] = 2.0
    satisfied_level: Annotated[
        Share,
        Meta(description="Level at which a need counts as satisfied, 0 to 1."),
    ] = 0.1
    approach_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance from an object within which the agent is at it, in m, "
            "above 0 to 10000: its goal is the nearest free place."
        ),
    ] = 20.0
    snap_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance within which a blocked position is replaced by the nearest free "
            "place, in m, above 0 to 10000."
        ),
    ] = 3.0
    blind_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance ahead up to which the camera sees no ground, in m, above 0 to "
            "10000: what is there counts as road."
        ),
    ] = 4.5
    driven_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance from the path within which the ground counts as road, in m, "
            "above 0 to 10000."
        ),
    ] = 1.5
    visited_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance from the path within which a frontier promises nothing any "
            "longer, in m, above 0 to 10000."
        ),
    ] = 3.0
    turn_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance that is as much effort as turning round towards a frontier, in "
            "m, above 0 to 10000."
        ),
    ] = 15.0
    unknown_weight: Annotated[
        PositiveShare,
        Meta(description="Weight of links to places never seen as road, above 0 to 1."),
    ] = 0.1
    doubt_weight: Annotated[
        PositiveShare,
        Meta(
            description="Weight of links over road that is blocked, where no other route is left: "
            "it may be free again, above 0 to 1."
        ),
    ] = 0.02
    doubt_from_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance from the agent up to which it sees whether blocked road is free "
            "again, in m, above 0 to 10000."
        ),
    ] = 6.0
    doubt_after_s: Annotated[
        PositiveSeconds,
        Meta(
            description="Time after which road that was seen to be blocked may be free again, in "
            "s, above 0 to 3600."
        ),
    ] = 600.0
    max_doubts: Annotated[
        Cells,
        Meta(
            description="Routes over road that was blocked that are tried for a goal at first, and "
            "another each time after `doubt_after_s`, 1 to 10000."
        ),
    ] = 3
    flat_places: Annotated[
        int,
        Meta(
            ge=0,
            le=2**31,
            description="Places of a map up to which routes are planned on them at once; on more "
            "they are planned on coarser maps first, 0 to 2147483648.",
        ),
    ] = 250_000
    margin_cells: Annotated[
        Cells, Meta(description="Unknown places around the map that are planned over, 1 to 10000.")
    ] = 8
    beyond_cells: Annotated[
        Cells,
        Meta(description="Places outside the map as far as which goals are planned, 1 to 10000."),
    ] = 100
    keep_route: Annotated[
        float,
        Meta(
            ge=1,
            le=100,
            description="A plan is kept while its route is at most so many times the length of a "
            "new one, 1 to 100.",
        ),
    ] = 1.15
    tour_levels: Annotated[
        int,
        Meta(ge=1, le=6, description="Grids on which several goals are put into an order, 1 to 6."),
    ] = 3
    tour_factor: Annotated[
        int,
        Meta(
            ge=2,
            le=10,
            description="Cells of the first of these grids along a side, and of each next one "
            "along the side of a cell, 2 to 10.",
        ),
    ] = 3
    working_memory: Annotated[
        int, Meta(ge=2, le=7, description="Goals that are ordered exactly at a time, 2 to 7.")
    ] = 4
    off_route_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance from its route at which the agent plans anew, in m, "
            "above 0 to 10000."
        ),
    ] = 3.0
    sight_m: Annotated[
        PositiveMetres,
        Meta(description="Distance at which road is seen, in m, above 0 to 10000."),
    ] = 12.0
    frontier_offset_m: Annotated[
        PositiveMetres,
        Meta(
            description="Distance added to that of each frontier, so that a near one of little "
            "promise does not win, in m, above 0 to 10000."
        ),
    ] = 10.0
    same_frontier_cells: Annotated[
        Cells, Meta(description="Cells by which a frontier moves from plan to plan, 1 to 10000.")
    ] = 6
    keep_share: Annotated[
        Share,
        Meta(
            description="The frontier that the agent goes to is kept while it promises at least "
            "this share of the best, 0 to 1."
        ),
    ] = 0.6
