"""Where trees, lamps, parked cars, hedges and kiosks stand along the streets. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from services.sim.layout.plan import (
    PAVEMENT_WIDTH_M,
    STREET_WIDTH_M,
    Plot,
    Rectangle,
    Road,
    overlap,
)

_SPACING_M = 5.0
_SCATTERED = 30
_AROUND_M = 55.0


@dataclass(frozen=True)
class Prop:
    """A prop where it stands; `size_m` is length along its heading, width, and height; `look` seeds
    its picture.
    """

    kind: str
    x_m: float
    y_m: float
    heading_rad: float
    size_m: tuple[float, float, float]
    look: int

    @property
    def area(self) -> Rectangle:
        """West, south, east, north of what holds it."""
        long = self.size_m[0] / 2
        wide = self.size_m[1] / 2
        along = abs(math.cos(self.heading_rad))
        across = abs(math.sin(self.heading_rad))
        reach_x = along * long + across * wide
        reach_y = across * long + along * wide
        return self.x_m - reach_x, self.y_m - reach_y, self.x_m + reach_x, self.y_m + reach_y


_SIZES: dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "tree": ((1.4, 1.4, 3.0), (2.6, 2.6, 6.0)),
    "lamp": ((0.6, 0.6, 4.5), (0.7, 0.7, 5.5)),
    "car": ((3.8, 1.7, 1.4), (4.6, 1.9, 1.7)),
    "hedge": ((2.0, 0.8, 0.9), (5.0, 1.0, 1.5)),
    "kiosk": ((1.6, 1.6, 2.2), (2.4, 2.0, 2.7)),
    "bin": ((0.6, 0.6, 1.0), (0.8, 0.8, 1.3)),
}
_OFTEN = (0.38, 0.14, 0.18, 0.14, 0.08, 0.08)


def furnish(seed: int, roads: Sequence[Road], plots: Sequence[Plot]) -> tuple[Prop, ...]:
    """Props along `roads` and some farther off, clear of every street and every building."""
    rng = np.random.default_rng([seed, 0xF0])
    streets = [road.area(STREET_WIDTH_M / 2) for road in roads]
    props: list[Prop] = []

    def put(prop: Prop) -> None:
        taken = [*streets, *(other.area for other in props), *(plot.footprint for plot in plots)]
        if not any(overlap(prop.area, area, 0.1) for area in taken):
            props.append(prop)

    for road in roads:
        for side in (-1.0, 1.0):
            along_m = float(rng.uniform(0, _SPACING_M))
            while along_m < road.length_m:
                put(_beside(rng, road, along_m, side))
                along_m += float(rng.uniform(0.6, 2.0)) * _SPACING_M
    for _ in range(_SCATTERED):
        x_m, y_m = rng.uniform(-_AROUND_M, _AROUND_M, 2).tolist()
        put(_prop(rng, x_m, y_m, float(rng.uniform(-math.pi, math.pi))))
    return tuple(props)


def _prop(rng: np.random.Generator, x_m: float, y_m: float, heading_rad: float) -> Prop:
    kind = str(rng.choice(list(_SIZES), p=_OFTEN))
    least, most = _SIZES[kind]
    length, width, height = (
        round(float(rng.uniform(a, b)), 2) for a, b in zip(least, most, strict=True)
    )
    return Prop(
        kind,
        round(x_m, 3),
        round(y_m, 3),
        heading_rad,
        (length, width, height),
        int(rng.integers(2**31)),
    )


def _beside(rng: np.random.Generator, road: Road, along_m: float, side: float) -> Prop:
    """A prop on the pavement, or as near to it as its size lets it."""
    prop = _prop(rng, 0.0, 0.0, road.heading_rad)
    clear_m = STREET_WIDTH_M / 2 + 0.15 + prop.size_m[1] / 2
    left_m = side * float(rng.uniform(clear_m, max(clear_m, STREET_WIDTH_M / 2 + PAVEMENT_WIDTH_M)))
    x, y = road.point(along_m, left_m)
    return replace(prop, x_m=round(x, 3), y_m=round(y, 3))
