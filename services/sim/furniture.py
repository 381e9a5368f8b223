"""What stands along a street besides buildings: trees, lamps, parked cars, hedges, kiosks. Pure."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from services.sim.catalogue import Colour
from services.sim.mesh import Mesh, Vertex
from services.sim.plan import PAVEMENT_WIDTH_M, STREET_WIDTH_M, Plot, Rectangle, Road, overlap
from services.sim.wall import Image, roughen

_SIDES = 9
_SPACING_M = 5.0
_SCATTERED, _AROUND_M = 30, 55.0
_DARK: Colour = (40, 42, 46)


@dataclass(frozen=True)
class Prop:
    """A prop where it stands; `size_m` is length along its heading, width, and height; `look` seeds its picture."""

    kind: str
    x_m: float
    y_m: float
    heading_rad: float
    size_m: tuple[float, float, float]
    look: int

    @property
    def area(self) -> Rectangle:
        """West, south, east, north of what holds it."""
        long, wide = self.size_m[0] / 2, self.size_m[1] / 2
        along, across = abs(math.cos(self.heading_rad)), abs(math.sin(self.heading_rad))
        reach_x, reach_y = along * long + across * wide, across * long + along * wide
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
    length, width, height = (round(float(rng.uniform(a, b)), 2) for a, b in zip(least, most, strict=True))
    return Prop(kind, round(x_m, 3), round(y_m, 3), heading_rad, (length, width, height), int(rng.integers(2**31)))


def _beside(rng: np.random.Generator, road: Road, along_m: float, side: float) -> Prop:
    """A prop on the pavement, or as near to it as its size lets it."""
    prop = _prop(rng, 0.0, 0.0, road.heading_rad)
    clear_m = STREET_WIDTH_M / 2 + 0.15 + prop.size_m[1] / 2
    left_m = side * float(rng.uniform(clear_m, max(clear_m, STREET_WIDTH_M / 2 + PAVEMENT_WIDTH_M)))
    x, y = road.point(along_m, left_m)
    return replace(prop, x_m=round(x, 3), y_m=round(y, 3))


def shape(prop: Prop) -> tuple[Mesh, Image]:
    """The prop around the origin, length along x, and the picture on it: two colours, side by side."""
    rng = np.random.default_rng(prop.look)
    mesh = Mesh()
    colours = _BUILD[prop.kind](mesh, prop.size_m, rng)
    picture = np.repeat(np.repeat(np.array([colours], np.uint8), 64, axis=0), 32, axis=1)
    return mesh, roughen(np.ascontiguousarray(picture), rng, 0.25)


def _tree(mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator) -> tuple[Colour, Colour]:
    reach, tall = size_m[0] / 2, size_m[2]
    _turned(mesh, [(0.16, 0.0), (0.14, 0.5 * tall)], 0)
    crown = [(math.sin(a), -math.cos(a)) for a in np.linspace(0, math.pi, 6).tolist()]
    _turned(mesh, [(reach * r, 0.66 * tall + 0.34 * tall * z) for r, z in crown], 1)
    return (92, 66, 44), _tinted((58, 112, 44), rng)


def _lamp(mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator) -> tuple[Colour, Colour]:
    tall = size_m[2]
    _turned(mesh, [(0.09, 0.0), (0.06, tall - 0.4)], 0)
    _turned(mesh, [(0.1, tall - 0.4), (0.28, tall - 0.1), (0.0, tall)], 1)
    return _DARK, _tinted((226, 220, 190), rng)


def _car(mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator) -> tuple[Colour, Colour]:
    long, wide, tall = size_m
    _box(mesh, (-long / 2, -wide / 2, 0.12), (long / 2, wide / 2, 0.58 * tall), 1)
    _box(mesh, (-0.3 * long, -0.46 * wide, 0.58 * tall), (0.24 * long, 0.46 * wide, tall), 0)
    red, green, blue = rng.integers(30, 235, 3).tolist()
    return _DARK, (red, green, blue)


def _hedge(mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator) -> tuple[Colour, Colour]:
    long, wide, tall = size_m
    _box(mesh, (-long / 2, -wide / 2, 0.0), (long / 2, wide / 2, tall), 1)
    return _DARK, _tinted((50, 96, 40), rng)


def _kiosk(mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator) -> tuple[Colour, Colour]:
    long, wide, tall = size_m
    _box(mesh, (-long / 2, -wide / 2, 0.0), (long / 2, wide / 2, tall - 0.3), 0)
    _box(mesh, (-0.6 * long, -0.6 * wide, tall - 0.3), (0.6 * long, 0.6 * wide, tall), 1)
    first, second = (rng.integers(40, 230, 3).tolist() for _ in range(2))
    return (first[0], first[1], first[2]), (second[0], second[1], second[2])


def _bin(mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator) -> tuple[Colour, Colour]:
    reach, tall = size_m[0] / 2, size_m[2]
    _turned(mesh, [(0.85 * reach, 0.0), (reach, tall), (0.0, tall)], 1)
    return _DARK, _tinted((70, 84, 90), rng)


_BUILD: dict[str, Callable[[Mesh, tuple[float, float, float], np.random.Generator], tuple[Colour, Colour]]] = {
    "tree": _tree,
    "lamp": _lamp,
    "car": _car,
    "hedge": _hedge,
    "kiosk": _kiosk,
    "bin": _bin,
}


def _tinted(colour: Colour, rng: np.random.Generator) -> Colour:
    pixel = np.array([[colour]], np.uint8)
    hue, saturation, value = (int(v) for v in cv2.cvtColor(pixel, cv2.COLOR_RGB2HSV)[0, 0])
    turned = (hue + int(rng.integers(-8, 9))) % 180, saturation, int(np.clip(value * rng.uniform(0.75, 1.3), 0, 255))
    red, green, blue = cv2.cvtColor(np.array([[turned]], np.uint8), cv2.COLOR_HSV2RGB)[0, 0].tolist()
    return red, green, blue


def _turned(mesh: Mesh, profile: Sequence[tuple[float, float]], half: int) -> None:
    """A body of rotation from (radius, height) points upwards, painted with one half of the picture."""
    angles = np.linspace(0, math.tau, _SIDES + 1).tolist()
    rings = [(r, z, v) for (r, z), v in zip(profile, np.linspace(1, 0, len(profile)).tolist(), strict=True)]
    for (r0, z0, v0), (r1, z1, v1) in itertools.pairwise(rings):
        for number, (a, b) in enumerate(itertools.pairwise(angles)):
            corners: list[Vertex] = [
                (r0 * math.cos(a), r0 * math.sin(a), z0),
                (r0 * math.cos(b), r0 * math.sin(b), z0),
                (r1 * math.cos(b), r1 * math.sin(b), z1),
                (r1 * math.cos(a), r1 * math.sin(a), z1),
            ]
            u0, u1 = (half / 2 + 0.02 + 0.46 * (number + side) / _SIDES for side in (0, 1))
            middle = (a + b) / 2
            mesh.polygon(corners, [(u0, v0), (u1, v0), (u1, v1), (u0, v1)], (math.cos(middle), math.sin(middle), 0.3))


def _box(mesh: Mesh, low: Vertex, high: Vertex, half: int) -> None:
    """A box without a floor, painted with one half of the picture."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    u0, u1 = half / 2 + 0.02, half / 2 + 0.48
    uvs = [(u0, 1.0), (u1, 1.0), (u1, 0.0), (u0, 0.0)]
    ground = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    for (ax, ay), (bx, by) in itertools.pairwise(ground):
        mesh.polygon([(ax, ay, z0), (bx, by, z0), (bx, by, z1), (ax, ay, z1)], uvs)
    mesh.polygon([(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)], uvs)
