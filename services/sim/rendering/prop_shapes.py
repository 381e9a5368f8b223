"""The shapes of trees, lamps, parked cars, hedges and kiosks: a mesh and its picture. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np

from cogmap.services.sim.layout.catalogue import Colour
from cogmap.services.sim.layout.furniture import CHARGING_PLACE, Prop, Size
from cogmap.services.sim.rendering.mesh import Mesh, Vertex
from cogmap.services.sim.rendering.wall import Image, roughen

Colours = tuple[Colour, Colour]

_SIDES = 9
_ANGLES_RAD: list[float] = np.linspace(0, math.tau, _SIDES + 1).tolist()
# Strength of the grain that stereo matching needs: twice a wall's.
_GRAIN = 0.25
_DARK: Colour = (40, 42, 46)
_RED: Colour = (206, 34, 30)
_MAGENTA: Colour = (214, 24, 178)
_WHITE: Colour = (240, 238, 232)
_BOARD_M = 1.0
_BARK: Colour = (92, 66, 44)
# The two halves of the picture, each with one of the two colours.
_FIRST = 0.0
_SECOND = 0.5
_MARGIN = 0.02
_HALF_WIDTH = 0.46


class Ring(NamedTuple):
    """A circle around the vertical axis, and its height in the picture."""

    radius_m: float
    z_m: float
    v: float


def shape(prop: Prop) -> tuple[Mesh, Image]:
    """Make a prop at the origin, length along x, and its picture: two colours, side by side."""
    rng = np.random.default_rng(prop.look)

    mesh = Mesh()
    colours = _BUILD[prop.kind](mesh, prop.size_m, rng)

    pixels = np.array([colours], np.uint8)
    picture = pixels.repeat(64, axis=0).repeat(32, axis=1)

    return mesh, roughen(picture, rng, _GRAIN)


def tree(mesh: Mesh, size_m: Size, rng: np.random.Generator) -> Colours:
    """Add a trunk and a crown."""
    width_m, _, tall_m = size_m
    reach_m = width_m / 2

    trunk = [(0.16, 0.0), (0.14, 0.5 * tall_m)]
    _rotate(mesh, trunk, _FIRST)

    crown = []  # an ellipse
    for angle_rad in np.linspace(0, math.pi, 6).tolist():
        radius_m = reach_m * math.sin(angle_rad)
        z_m = 0.66 * tall_m + 0.34 * tall_m * -math.cos(angle_rad)
        crown.append((radius_m, z_m))
    _rotate(mesh, crown, _SECOND)

    return _BARK, _tinted((58, 112, 44), rng)


def lamp(mesh: Mesh, size_m: Size, rng: np.random.Generator) -> Colours:
    """Add a post with a shade."""
    _, _, tall_m = size_m
    neck_m = tall_m - 0.4

    post = [(0.09, 0.0), (0.06, neck_m)]
    _rotate(mesh, post, _FIRST)

    shade = [(0.1, neck_m), (0.28, tall_m - 0.1), (0.0, tall_m)]
    _rotate(mesh, shade, _SECOND)

    return _DARK, _tinted((226, 220, 190), rng)


def car(mesh: Mesh, size_m: Size, rng: np.random.Generator) -> Colours:
    """Add a body with a cabin."""
    long_m, wide_m, tall_m = size_m
    bonnet_m = 0.58 * tall_m

    body_low = (-long_m / 2, -wide_m / 2, 0.12)
    body_high = (long_m / 2, wide_m / 2, bonnet_m)
    _box(mesh, body_low, body_high, _SECOND)

    cabin_low = (-0.3 * long_m, -0.46 * wide_m, bonnet_m)
    cabin_high = (0.24 * long_m, 0.46 * wide_m, tall_m)
    _box(mesh, cabin_low, cabin_high, _FIRST)

    return _DARK, _any_colour(rng, 30, 235)


def hedge(mesh: Mesh, size_m: Size, rng: np.random.Generator) -> Colours:
    """Add a hedge."""
    long_m, wide_m, tall_m = size_m

    low = (-long_m / 2, -wide_m / 2, 0.0)
    high = (long_m / 2, wide_m / 2, tall_m)
    _box(mesh, low, high, _SECOND)

    return _DARK, _tinted((50, 96, 40), rng)


def kiosk(mesh: Mesh, size_m: Size, rng: np.random.Generator) -> Colours:
    """Add a hut with a roof."""
    long_m, wide_m, tall_m = size_m
    eaves_m = tall_m - 0.3

    hut_low = (-long_m / 2, -wide_m / 2, 0.0)
    hut_high = (long_m / 2, wide_m / 2, eaves_m)
    _box(mesh, hut_low, hut_high, _FIRST)

    roof_low = (-0.6 * long_m, -0.6 * wide_m, eaves_m)
    roof_high = (0.6 * long_m, 0.6 * wide_m, tall_m)
    _box(mesh, roof_low, roof_high, _SECOND)

    hut_colour = _any_colour(rng, 40, 230)

    return hut_colour, _any_colour(rng, 40, 230)


def litter_bin(mesh: Mesh, size_m: Size, rng: np.random.Generator) -> Colours:
    """Add a bin."""
    width_m, _, tall_m = size_m
    reach_m = width_m / 2

    profile = [(0.85 * reach_m, 0.0), (reach_m, tall_m), (0.0, tall_m)]
    _rotate(mesh, profile, _SECOND)

    return _DARK, _tinted((70, 84, 90), rng)


def barrier(mesh: Mesh, size_m: Size, rng: np.random.Generator) -> Colours:
    """Add boards across the street, red and white by turns."""
    long_m, wide_m, tall_m = size_m
    count = max(2, round(long_m / _BOARD_M))
    edges_m = np.linspace(-long_m / 2, long_m / 2, count + 1).tolist()

    for number, (start_m, end_m) in enumerate(pairwise(edges_m)):
        low = (start_m, -wide_m / 2, 0.0)
        high = (end_m, wide_m / 2, tall_m)
        _box(mesh, low, high, _SECOND if number % 2 else _FIRST)

    return _RED, _WHITE


def charging_place(mesh: Mesh, size_m: Size, rng: np.random.Generator) -> Colours:
    """Add a post with a wide head."""
    long_m, wide_m, tall_m = size_m
    neck_m = 0.6 * tall_m

    post_low = (-0.3 * long_m, -0.3 * wide_m, 0.0)
    post_high = (0.3 * long_m, 0.3 * wide_m, neck_m)
    _box(mesh, post_low, post_high, _FIRST)

    head_low = (-long_m / 2, -wide_m / 2, neck_m)
    head_high = (long_m / 2, wide_m / 2, tall_m)
    _box(mesh, head_low, head_high, _SECOND)

    return _WHITE, _MAGENTA


_BUILD: dict[str, Callable[[Mesh, Size, np.random.Generator], Colours]] = {
    "tree": tree,
    "lamp": lamp,
    "car": car,
    "hedge": hedge,
    "kiosk": kiosk,
    "bin": litter_bin,
    "barrier": barrier,
    CHARGING_PLACE: charging_place,
}


def _any_colour(rng: np.random.Generator, least: int, most: int) -> Colour:
    red, green, blue = rng.integers(least, most, 3).tolist()
    return red, green, blue


def _tinted(colour: Colour, rng: np.random.Generator) -> Colour:
    """Vary the hue and brightness of `colour` a little."""
    hue, saturation, value = _converted(colour, cv2.COLOR_RGB2HSV)
    new_hue = (hue + int(rng.integers(-8, 9))) % 180

    brighter = value * rng.uniform(0.75, 1.3)
    new_value = int(np.clip(brighter, 0, 255))
    return _converted((new_hue, saturation, new_value), cv2.COLOR_HSV2RGB)


def _converted(colour: Colour, conversion: int) -> Colour:
    """Convert `colour` to another colour space, by one of OpenCV's conversions."""
    pixel = np.array([[colour]], np.uint8)
    first, second, third = cv2.cvtColor(pixel, conversion)[0, 0].tolist()
    return first, second, third


def _rotate(mesh: Mesh, profile: Sequence[tuple[float, float]], half: float) -> None:
    """Add a body of rotation from (radius, height) points upwards, painted with one half of the
    picture.
    """
    heights = np.linspace(1, 0, len(profile)).tolist()
    rings = [Ring(radius, z, v) for (radius, z), v in zip(profile, heights, strict=True)]

    for number, (start_rad, end_rad) in enumerate(pairwise(_ANGLES_RAD)):
        left = half + _MARGIN + _HALF_WIDTH * number / _SIDES
        right = half + _MARGIN + _HALF_WIDTH * (number + 1) / _SIDES
        middle_rad = (start_rad + end_rad) / 2
        # Outwards and a little upwards.
        normal = (math.cos(middle_rad), math.sin(middle_rad), 0.3)

        for lower, upper in pairwise(rings):
            corners = [
                _on_ring(lower, start_rad),
                _on_ring(lower, end_rad),
                _on_ring(upper, end_rad),
                _on_ring(upper, start_rad),
            ]
            uvs = [(left, lower.v), (right, lower.v), (right, upper.v), (left, upper.v)]
            mesh.polygon(corners, uvs, normal)


def _on_ring(ring: Ring, angle_rad: float) -> Vertex:
    x_m = ring.radius_m * math.cos(angle_rad)
    y_m = ring.radius_m * math.sin(angle_rad)
    return x_m, y_m, ring.z_m


def _box(mesh: Mesh, low: Vertex, high: Vertex, half: float) -> None:
    """Add a box without a floor, painted with one half of the picture."""
    west, south, bottom_m = low
    east, north, top_m = high
    ground = [(west, south), (east, south), (east, north), (west, north)]

    # The corners of that half, from its lower left counter-clockwise.
    left = half + _MARGIN
    right = left + _HALF_WIDTH
    uvs = [(left, 1.0), (right, 1.0), (right, 0.0), (left, 0.0)]
    for start, end in pairwise([*ground, ground[0]]):
        wall = [(*start, bottom_m), (*end, bottom_m), (*end, top_m), (*start, top_m)]
        mesh.polygon(wall, uvs)

    lid = [(x, y, top_m) for x, y in ground]
    mesh.polygon(lid, uvs)
