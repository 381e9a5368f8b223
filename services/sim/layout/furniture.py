"""Where trees, lamps, parked cars, hedges and kiosks stand along the streets. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cogmap.services.sim.layout.plan import (
    PAVEMENT_WIDTH_M,
    Plot,
    Point,
    Rectangle,
    Road,
    corners,
    overlap,
)

Size = tuple[float, float, float]

CHARGING_PLACE = "charging-place"
# Made up: about how far props are apart along a street; how many stand elsewhere, and how far from
# the middle; gaps to the kerb, and to all else.
_SPACING_M = 5.0
_SCATTERED = 30
_AROUND_M = 55.0
_KERB_M = 0.15
_GAP_M = 0.1


@dataclass(frozen=True)
class Prop:
    """A prop where it stands; `size_m` is length along its heading, width, and height; `look` seeds
    its picture.
    """

    kind: str
    x_m: float
    y_m: float
    heading_rad: float
    size_m: Size
    look: int

    @property
    def area(self) -> Rectangle:
        """Return west, south, east, north of its bounding box."""
        length_m, width_m, _ = self.size_m
        half_length_m = length_m / 2
        half_width_m = width_m / 2
        cos = abs(math.cos(self.heading_rad))
        sin = abs(math.sin(self.heading_rad))

        reach_x_m = cos * half_length_m + sin * half_width_m
        reach_y_m = sin * half_length_m + cos * half_width_m

        return (
            self.x_m - reach_x_m,
            self.y_m - reach_y_m,
            self.x_m + reach_x_m,
            self.y_m + reach_y_m,
        )

    @property
    def solid_size_m(self) -> Size:
        """Return the length, width and height of what stands in the way of a robot: of a tree or a
        lamp its trunk.
        """
        length_m, width_m, height_m = self.size_m
        trunk_m = _TRUNKS_M.get(self.kind)
        if trunk_m is None:
            return length_m, width_m, height_m

        return trunk_m, trunk_m, height_m

    @property
    def seen(self) -> tuple[Point, ...]:
        """Return the corners of what a range scan meets, counter-clockwise: of a tree its crown."""
        length_m, width_m, _ = self.size_m
        share = _CROWN_SHARE if self.kind == "tree" else 1.0
        size_m = (share * length_m, share * width_m)
        return corners((self.x_m, self.y_m), self.heading_rad, size_m)

    @property
    def solid(self) -> tuple[Point, ...]:
        """Return the corners of what stands in the way of a robot, counter-clockwise."""
        length_m, width_m, _ = self.solid_size_m
        return corners((self.x_m, self.y_m), self.heading_rad, (length_m, width_m))


# A crown is an ellipse: a box of the same width would reach too far.
_CROWN_SHARE = 0.8
_TRUNKS_M = {"tree": 0.4, "lamp": 0.2}
_SIZES: dict[str, tuple[Size, Size]] = {
    "tree": ((1.4, 1.4, 3.0), (2.6, 2.6, 6.0)),
    "lamp": ((0.6, 0.6, 4.5), (0.7, 0.7, 5.5)),
    "car": ((3.8, 1.7, 1.4), (4.6, 1.9, 1.7)),
    "hedge": ((2.0, 0.8, 0.9), (5.0, 1.0, 1.5)),
    "kiosk": ((1.6, 1.6, 2.2), (2.4, 2.0, 2.7)),
    "bin": ((0.6, 0.6, 1.0), (0.8, 0.8, 1.3)),
}
_PROBABILITIES = (0.38, 0.14, 0.18, 0.14, 0.08, 0.08)


def furnish(seed: int, roads: Sequence[Road], plots: Sequence[Plot]) -> tuple[Prop, ...]:
    """Draw props along `roads` and some farther away, clear of every street and every building."""
    rng = np.random.default_rng([seed, 0xF0])
    candidates = _along(rng, roads, _SPACING_M)
    for _ in range(_SCATTERED):
        x_m, y_m = rng.uniform(-_AROUND_M, _AROUND_M, 2).tolist()
        heading_rad = float(rng.uniform(-math.pi, math.pi))
        candidates.append(_some_prop(rng, x_m, y_m, heading_rad))

    return _clear(candidates, roads, plots)


def line_pavements(
    rng: np.random.Generator, roads: Sequence[Road], plots: Sequence[Plot], spacing_m: float
) -> tuple[Prop, ...]:
    """Draw props along `roads`, clear of every street and every building."""
    candidates = _along(rng, roads, spacing_m)
    return _clear(candidates, roads, plots)


def _clear(
    candidates: Sequence[Prop], roads: Sequence[Road], plots: Sequence[Plot]
) -> tuple[Prop, ...]:
    """Keep the candidates that stand on no street, in no building and in none kept before them."""
    occupied = [road.kerbs for road in roads]
    occupied += [plot.footprint for plot in plots]

    props: list[Prop] = []
    for prop in candidates:
        area = prop.area
        is_free = not any(overlap(area, other, _GAP_M) for other in occupied)
        if is_free:
            props.append(prop)
            occupied.append(area)

    return tuple(props)


def _along(rng: np.random.Generator, roads: Sequence[Road], spacing_m: float) -> list[Prop]:
    """Draw candidates on both pavements of each road."""
    props = []
    for road in roads:
        for side in (-1.0, 1.0):
            along_m = float(rng.uniform(0, spacing_m))
            while along_m < road.length_m:
                props.append(_beside(rng, road, along_m, side))
                along_m += float(rng.uniform(0.6, 2.0)) * spacing_m

    return props


def _some_prop(rng: np.random.Generator, x_m: float, y_m: float, heading_rad: float) -> Prop:
    kind = str(rng.choice(list(_SIZES), p=_PROBABILITIES))
    return prop_of_kind(rng, kind, (x_m, y_m), heading_rad)


def prop_of_kind(rng: np.random.Generator, kind: str, at_m: Point, heading_rad: float) -> Prop:
    """Draw a prop of one kind, of one of the usual sizes."""
    x_m, y_m = at_m
    least_m, most_m = _SIZES[kind]
    length_m, width_m, height_m = rng.uniform(least_m, most_m).round(2).tolist()

    return Prop(
        kind=kind,
        x_m=round(x_m, 3),
        y_m=round(y_m, 3),
        heading_rad=heading_rad,
        size_m=(length_m, width_m, height_m),
        look=int(rng.integers(2**31)),
    )


def _beside(rng: np.random.Generator, road: Road, along_m: float, side: float) -> Prop:
    """Draw a prop on the pavement, or as near to it as its size allows."""
    prop = _some_prop(rng, 0.0, 0.0, road.heading_rad)
    _, width_m, _ = prop.size_m

    kerb_m = road.width_m / 2
    least_m = kerb_m + _KERB_M + width_m / 2
    most_m = max(least_m, kerb_m + PAVEMENT_WIDTH_M)
    left_m = side * float(rng.uniform(least_m, most_m))

    x_m, y_m = road.point(along_m, left_m)
    return replace(prop, x_m=round(x_m, 3), y_m=round(y_m, 3))
