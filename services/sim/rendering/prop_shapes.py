"""What trees, lamps, parked cars, hedges and kiosks look like: a mesh and its picture. Pure."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import cv2
import numpy as np

from services.sim.layout.catalogue import Colour
from services.sim.layout.furniture import Prop
from services.sim.rendering.mesh import Mesh, Vertex
from services.sim.rendering.wall import Image, roughen

_SIDES = 9
_DARK: Colour = (40, 42, 46)


def shape(prop: Prop) -> tuple[Mesh, Image]:
    """The prop around the origin, length along x, and the picture on it: two colours, side by side."""
    rng = np.random.default_rng(prop.look)
    mesh = Mesh()
    colours = _BUILD[prop.kind](mesh, prop.size_m, rng)
    picture = np.repeat(np.repeat(np.array([colours], np.uint8), 64, axis=0), 32, axis=1)
    return mesh, roughen(np.ascontiguousarray(picture), rng, 0.25)


def _tree(
    mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator
) -> tuple[Colour, Colour]:
    reach = size_m[0] / 2
    tall = size_m[2]
    _turned(mesh, [(0.16, 0.0), (0.14, 0.5 * tall)], 0)
    crown = [(math.sin(a), -math.cos(a)) for a in np.linspace(0, math.pi, 6).tolist()]
    _turned(mesh, [(reach * r, 0.66 * tall + 0.34 * tall * z) for r, z in crown], 1)
    return (92, 66, 44), _tinted((58, 112, 44), rng)


def _lamp(
    mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator
) -> tuple[Colour, Colour]:
    tall = size_m[2]
    _turned(mesh, [(0.09, 0.0), (0.06, tall - 0.4)], 0)
    _turned(mesh, [(0.1, tall - 0.4), (0.28, tall - 0.1), (0.0, tall)], 1)
    return _DARK, _tinted((226, 220, 190), rng)


def _car(
    mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator
) -> tuple[Colour, Colour]:
    long, wide, tall = size_m
    _box(mesh, (-long / 2, -wide / 2, 0.12), (long / 2, wide / 2, 0.58 * tall), 1)
    _box(mesh, (-0.3 * long, -0.46 * wide, 0.58 * tall), (0.24 * long, 0.46 * wide, tall), 0)
    red, green, blue = rng.integers(30, 235, 3).tolist()
    return _DARK, (red, green, blue)


def _hedge(
    mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator
) -> tuple[Colour, Colour]:
    long, wide, tall = size_m
    _box(mesh, (-long / 2, -wide / 2, 0.0), (long / 2, wide / 2, tall), 1)
    return _DARK, _tinted((50, 96, 40), rng)


def _kiosk(
    mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator
) -> tuple[Colour, Colour]:
    long, wide, tall = size_m
    _box(mesh, (-long / 2, -wide / 2, 0.0), (long / 2, wide / 2, tall - 0.3), 0)
    _box(mesh, (-0.6 * long, -0.6 * wide, tall - 0.3), (0.6 * long, 0.6 * wide, tall), 1)
    first, second = (rng.integers(40, 230, 3).tolist() for _ in range(2))
    return (first[0], first[1], first[2]), (second[0], second[1], second[2])


def _bin(
    mesh: Mesh, size_m: tuple[float, float, float], rng: np.random.Generator
) -> tuple[Colour, Colour]:
    reach = size_m[0] / 2
    tall = size_m[2]
    _turned(mesh, [(0.85 * reach, 0.0), (reach, tall), (0.0, tall)], 1)
    return _DARK, _tinted((70, 84, 90), rng)


_BUILD: dict[
    str, Callable[[Mesh, tuple[float, float, float], np.random.Generator], tuple[Colour, Colour]]
] = {
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
    turned = (
        (hue + int(rng.integers(-8, 9))) % 180,
        saturation,
        int(np.clip(value * rng.uniform(0.75, 1.3), 0, 255)),
    )
    red, green, blue = cv2.cvtColor(np.array([[turned]], np.uint8), cv2.COLOR_HSV2RGB)[
        0, 0
    ].tolist()
    return red, green, blue


def _turned(mesh: Mesh, profile: Sequence[tuple[float, float]], half: int) -> None:
    """A body of rotation from (radius, height) points upwards, painted with one half of the
    picture.
    """
    angles = np.linspace(0, math.tau, _SIDES + 1).tolist()
    rings = [
        (r, z, v)
        for (r, z), v in zip(profile, np.linspace(1, 0, len(profile)).tolist(), strict=True)
    ]
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
            mesh.polygon(
                corners,
                [(u0, v0), (u1, v0), (u1, v1), (u0, v1)],
                (math.cos(middle), math.sin(middle), 0.3),
            )


def _box(mesh: Mesh, low: Vertex, high: Vertex, half: int) -> None:
    """A box without a floor, painted with one half of the picture."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    u0 = half / 2 + 0.02
    u1 = half / 2 + 0.48
    uvs = [(u0, 1.0), (u1, 1.0), (u1, 0.0), (u0, 0.0)]
    ground = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    for (ax, ay), (bx, by) in itertools.pairwise(ground):
        mesh.polygon([(ax, ay, z0), (bx, by, z0), (bx, by, z1), (ax, ay, z1)], uvs)
    mesh.polygon([(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)], uvs)
