"""A town of several blocks from a seed. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from schemas.sensing import Pose
from services.sim.layout.blocks import districts, obstacles, streets
from services.sim.layout.blocks.buildings import settle
from services.sim.layout.furniture import Prop
from services.sim.layout.place import Place
from services.sim.layout.plan import Point, Road

SIZE_M = 200.0
CLEAR_M = 8.0
STEP_M = 1.0


@dataclass(frozen=True)
class BlocksTown(Place):
    """Streets of different widths with crossings, dead ends and a square, and districts whose
    buildings share a style and a function.
    """

    dead_ends: tuple[Road, ...]
    square: Road


def generate(seed: int, size_m: float = SIZE_M) -> BlocksTown:
    """The town of `seed`, about `size_m` to the side: the same every time.

    No building is on a street or another; all streets are connected, also with any one closed that
    is no dead end.
    """
    rng = np.random.default_rng([seed, 0xB10C])
    plan = streets.plan(rng, size_m)
    plots = settle(rng, plan.roads, districts.divide(rng, plan.grid))
    props = obstacles.furnish(rng, plan, plots)

    return BlocksTown(
        seed=seed,
        roads=plan.roads,
        plots=plots,
        props=props,
        start=_start(rng, plan.roads, props),
        dead_ends=plan.dead_ends,
        square=plan.square,
    )


def _start(rng: np.random.Generator, roads: Sequence[Road], props: Sequence[Prop]) -> Pose:
    """A place in the middle of some street, with nothing within CLEAR_M of it."""
    middles_m = np.array([(prop.x_m, prop.y_m) for prop in props])

    for number in rng.permutation(len(roads)).tolist():
        road = roads[number]
        last_m = road.length_m - CLEAR_M
        for along_m in np.arange(CLEAR_M, last_m, STEP_M).tolist():
            here_m = road.point(along_m)
            away_m = middles_m - here_m
            if np.hypot(away_m[:, 0], away_m[:, 1]).min() > CLEAR_M:
                return _heading_along(road, here_m)

    return _heading_along(roads[0], roads[0].start)


def _heading_along(road: Road, here_m: Point) -> Pose:
    x_m, y_m = here_m
    return Pose(x_m=x_m, y_m=y_m, heading_rad=road.heading_rad)
