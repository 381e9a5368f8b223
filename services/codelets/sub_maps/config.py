"""How the map is structured."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

SECTION = "map_structure"

Weight = Annotated[float, Meta(ge=0, le=1000)]
Chance = Annotated[float, Meta(gt=0, lt=1)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The Dirichlet-process mixture over objects: the weight of each feature, and its prior.

    A weight is the power of that feature's likelihood: 0 leaves it out, 1 takes every object for
    independent evidence.
    """

    concentration: Annotated[
        float,
        Meta(
            description="concentration of the Dirichlet process: how readily there is one more "
            "sub-map, above 0, at most 1e6",
            gt=0,
            le=1e6,
        ),
    ] = 0.01
    position_weight: Annotated[
        Weight,
        Meta(description="weight of the positions of objects, 0 to 1000"),
    ] = 0.05
    spacing_weight: Annotated[
        Weight,
        Meta(description="weight of how densely objects stand, 0 to 1000"),
    ] = 0.5
    function_weight: Annotated[
        Weight,
        Meta(description="weight of the functions of objects, 0 to 1000"),
    ] = 1.0
    boundary_weight: Annotated[
        Weight,
        Meta(description="weight of the boundaries between neighbouring objects, 0 to 1000"),
    ] = 0.7
    gap_weight: Annotated[
        Weight,
        Meta(
            description="weight of open ground between neighbouring objects, wider than between "
            "others there, 0 to 1000"
        ),
    ] = 1.0
    sub_map_sd_m: Annotated[
        float,
        Meta(
            description="extent of a sub-map before any object is known: the standard deviation of "
            "its objects' positions, in m, above 0, at most 100000",
            gt=0,
            le=1e5,
        ),
    ] = 50.0
    function_concentration: Annotated[
        float,
        Meta(
            description="concentration of the prior over a sub-map's mix of functions, for each "
            "function, above 0, at most 1000",
            gt=0,
            le=1000,
        ),
    ] = 0.5
    crossed_within: Annotated[
        Chance,
        Meta(
            description="share of the neighbours of one sub-map that have a boundary between them, "
            "between 0 and 1"
        ),
    ] = 0.05
    crossed_between: Annotated[
        Chance,
        Meta(
            description="share of the neighbours of different sub-maps that have a boundary "
            "between them, between 0 and 1"
        ),
    ] = 0.6
    min_sightings: Annotated[
        int,
        Meta(
            description="views of an object before it gets into a sub-map, 1 to 1000",
            ge=1,
            le=1000,
        ),
    ] = 2
    reach_m: Annotated[
        float,
        Meta(
            description="distance up to which an object that arrives may change a sub-map, in m, "
            "above 0, at most 10000",
            gt=0,
            le=1e4,
        ),
    ] = 50.0
    moved_m: Annotated[
        float,
        Meta(
            description="a sub-map is sorted anew when its objects have moved its border by more, "
            "in m, above 0, at most 10000",
            gt=0,
            le=1e4,
        ),
    ] = 5.0
    places: Annotated[
        int,
        Meta(
            description="place nodes that the grid of a sub-map has about, by which it is fine or "
            "coarse, 1 to 1000000",
            ge=1,
            le=1_000_000,
        ),
    ] = 1600
