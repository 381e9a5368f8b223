"""How the maps on coarser grids are configured."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

COARSE_PLACES = "coarse_places"
SUB_MAP_PLACES = "sub_map_places"

Cycles = Annotated[int, Meta(ge=1, le=10_000)]
Reach = Annotated[
    float,
    Meta(
        gt=0,
        le=100,
        description="Distance from the agent within which the root map changes as it looks "
        "around, in m, above 0 to 100.",
    ),
]


class CoarsePlacesConfig(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """When the coarse maps are made anew."""

    every_cycles: Annotated[
        Cycles,
        Meta(description="Cycles between two updates of the coarse maps, 1 to 10000."),
    ] = 5
    reach_m: Reach = 30.0


class SubMapPlacesConfig(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """When the place nodes of sub-maps are made anew."""

    every_cycles: Annotated[
        Cycles,
        Meta(description="Cycles between two updates of the places of sub-maps, 1 to 10000."),
    ] = 10
    reach_m: Reach = 30.0
