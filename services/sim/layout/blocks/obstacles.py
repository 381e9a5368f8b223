"""What stands in the streets of a town of several blocks: parked cars, and a kiosk on the square.
Every street stays wide enough to drive. Pure.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cogmap.services.sim.layout.blocks.streets import Streets
from cogmap.services.sim.layout.furniture import Prop, line_pavements, prop_of_kind
from cogmap.services.sim.layout.plan import Plot, Road

# Made up: about how far props on pavements are apart; parked cars from their kerb, from crossings
# and from one another; the kiosk from the middle of the square.
PAVEMENT_SPACING_M = 9.0
KERB_GAP_M = 0.25
CROSSING_M = 12.0
APART_M = (9.0, 30.0)
ASIDE_M = (5.0, 8.0)


def furnish(
    rng: np.random.Generator, streets: Streets, plots: tuple[Plot, ...]
) -> tuple[Prop, ...]:
    """Draw props on the pavements, in the streets and on the square."""
    on_pavements = line_pavements(rng, streets.roads, plots, PAVEMENT_SPACING_M)

    # Cars at either kerb, one at a time, away from the crossings.
    parked = []
    for road in streets.roads:
        if road in streets.dead_ends:
            continue

        along_m = CROSSING_M + float(rng.uniform(0, APART_M[1]))
        while along_m < road.length_m - CROSSING_M:
            parked.append(_car(rng, road, along_m))
            along_m += float(rng.uniform(*APART_M))

    # A kiosk beside the middle of the square, clear of the streets that cross it.
    middle_x, middle_y = streets.square.middle
    sign_x, sign_y = rng.choice([-1.0, 1.0], 2).tolist()
    aside_x, aside_y = rng.uniform(*ASIDE_M, 2).tolist()
    at_m = (middle_x + sign_x * aside_x, middle_y + sign_y * aside_y)
    kiosk = prop_of_kind(rng, "kiosk", at_m, 0.0)

    return (*on_pavements, *parked, kiosk)


def _car(rng: np.random.Generator, road: Road, along_m: float) -> Prop:
    car = prop_of_kind(rng, "car", (0.0, 0.0), road.heading_rad)
    _, width_m, _ = car.size_m

    side = float(rng.choice([-1.0, 1.0]))
    from_middle_m = road.width_m / 2 - KERB_GAP_M - width_m / 2

    x_m, y_m = road.point(along_m, side * from_middle_m)
    return replace(car, x_m=round(x_m, 3), y_m=round(y_m, 3))
