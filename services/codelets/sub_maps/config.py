"""How the map is structured."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

SECTION = "map_structure"

Weight = Annotated[float, Meta(ge=0, le=1000)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The Dirichlet-process mixture over objects: the weight of each feature.

    A weight is the power of that feature's likelihood: 0 leaves it out, 1 takes every object for
    independent evidence.
    """

    concentration: Annotated[
        float,
        Meta(
            description="Concentration of the Dirichlet process: how readily there is one more "
            "sub-map.",
            gt=0,
            le=1e6,
        ),
    ] = 0.01
    position_weight: Annotated[
        Weight,
        Meta(description="Weight of the positions of objects."),
    ] = 0.05
    spacing_weight: Annotated[
        Weight,
        Meta(description="Weight of how densely objects stand."),
    ] = 0.5
    function_weight: Annotated[
        Weight,
        Meta(description="Weight of the functions of objects."),
    ] = 1.0
    boundary_weight: Annotated[
        Weight,
        Meta(description="Weight of the boundaries between neighbouring objects."),
    ] = 0.7
    gap_weight: Annotated[
        Weight,
        Meta(
            description="Weight of open ground between neighbouring objects, wider than between "
            "others there."
        ),
    ] = 1.0
