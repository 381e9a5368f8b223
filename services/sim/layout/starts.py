"""Where a robot begins in a town. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cogmap.schemas.sensing import Pose
from cogmap.services.sim.layout.furniture import Prop
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Point, Road

# From a start to props and to the ends of its street; between the places that are tried.
CLEAR_M = 8.0
STEP_M = 1.0


def another_start(place: Place, number: int) -> Pose:
    """Draw the start of that number, from 1 on, in a place that was made from a seed, in either
    direction along its street.
    """
    rng = np.random.default_rng([place.seed, number, 0x57])
    start = start_on(rng, place.roads, place.props)
    turn_rad = math.pi * float(rng.integers(2))
    return Pose(x_m=start.x_m, y_m=start.y_m, heading_rad=start.heading_rad + turn_rad)


def start_on(rng: np.random.Generator, roads: Sequence[Road], props: Sequence[Prop]) -> Pose:
    """Draw a place in the middle of some street, with nothing within CLEAR_M of it."""
    middles_m = np.array([(prop.x_m, prop.y_m) for prop in props]).reshape(-1, 2)

    for number in rng.permutation(len(roads)).tolist():
        road = roads[number]
        last_m = road.length_m - CLEAR_M
        for along_m in np.arange(CLEAR_M, last_m, STEP_M).tolist():
            here_m = road.point(along_m)
            away_m = middles_m - here_m
            if np.hypot(away_m[:, 0], away_m[:, 1]).min(initial=np.inf) > CLEAR_M:
                return _heading_along(road, here_m)

    return _heading_along(roads[0], roads[0].start)


def _heading_along(road: Road, here_m: Point) -> Pose:
    x_m, y_m = here_m
    return Pose(x_m=x_m, y_m=y_m, heading_rad=road.heading_rad)
