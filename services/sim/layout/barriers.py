"""Barriers that close streets. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cogmap.services.sim.layout.furniture import Prop
from cogmap.services.sim.layout.plan import PAVEMENT_WIDTH_M, Road

# Made up; the camera, at 1.5 m, sees over it.
THICKNESS_M = 0.4
HEIGHT_M = 1.2


def barriers(roads: Sequence[Road]) -> dict[str, Prop]:
    """Make a barrier for each street, by its name: of several roads of one name, the longest."""
    longest: dict[str, Road] = {}
    for road in roads:
        other = longest.setdefault(road.name, road)
        if road.length_m > other.length_m:
            longest[road.name] = road

    found = {}
    for name, road in longest.items():
        # Across the middle of the road and its pavements.
        x_m, y_m = road.middle
        found[name] = Prop(
            kind="barrier",
            x_m=x_m,
            y_m=y_m,
            heading_rad=math.remainder(road.heading_rad + math.pi / 2, math.tau),
            size_m=(road.width_m + 2 * PAVEMENT_WIDTH_M, THICKNESS_M, HEIGHT_M),
            look=0,
        )

    return found
