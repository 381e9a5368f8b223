"""A town of several blocks from a seed. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.services.sim.layout.blocks import districts, obstacles, streets
from cogmap.services.sim.layout.blocks.buildings import settle
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Road
from cogmap.services.sim.layout.starts import start_on

# As `sim.town_size_m` is by default.
SIZE_M = 200.0


@dataclass(frozen=True)
class BlocksTown(Place):
    """Streets of different widths with crossings, dead ends and a square, and districts whose
    buildings share a style and a function.
    """

    dead_ends: tuple[Road, ...]
    square: Road


def generate(seed: int, size_m: float = SIZE_M) -> BlocksTown:
    """Make the town of `seed`, about `size_m` to the side: the same every time.

    No building is on a street or another building. All streets stay connected if any one that is no
    dead end is closed.
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
        start=start_on(rng, plan.roads, props),
        dead_ends=plan.dead_ends,
        square=plan.square,
    )
