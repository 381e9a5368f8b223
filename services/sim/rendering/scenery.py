"""The ground and the sky of a town: grass, streets, and a sky with hills. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import cv2
import numpy as np

from cogmap.geometry.arrays import Singles
from cogmap.services.sim.layout.plan import PAVEMENT_WIDTH_M, Point, Road
from cogmap.services.sim.rendering.mesh import Mesh, Vertex, cuts
from cogmap.services.sim.rendering.wall import Image, plain, roughen

# The ground around the robot reaches beyond the sky, and the sky beyond all that is shown (95 m).
GROUND_M = 200.0
GRASS_TILE_M = 8.0
_DASH_M = 2.0
_SKY_M = 140.0
_SKY_TOP_M = 120.0
_SEGMENTS = 24
_PANORAMA_PX = (512, 2048)
_ZENITH = (118, 170, 226)
_HORIZON = (214, 228, 238)
_HILLS = ((0.105, (140, 164, 170)), (0.07, (104, 138, 112)))


def pictures() -> tuple[Image, Image, Image, Image]:
    """Return the pictures of grass, pavements, asphalt and the lines on it."""
    rng = np.random.default_rng(11)
    soil = roughen(plain(512, (104, 138, 66)), rng, 0.2)

    slabs = plain(128, (188, 180, 168))
    joint = (140, 134, 126)
    slabs[::32] = joint
    slabs[:, ::32] = joint
    slabs = roughen(slabs, rng, 0.1)

    asphalt = roughen(plain(512, (92, 92, 98)), rng, 0.15)
    paint = roughen(plain(64, (232, 230, 220)), rng, 0.06)
    return soil, slabs, asphalt, paint


def streets(roads: Sequence[Road]) -> tuple[Mesh, Mesh, Mesh]:
    """Return pavements, asphalt and the dashes along the middle of it, from below upwards."""
    pavements = Mesh()
    asphalt = Mesh()
    lines = Mesh()
    for road in roads:
        half_m = road.width_m / 2
        _pave(pavements, road, half_m + PAVEMENT_WIDTH_M, 0.015, (4.0, 8.0))
        _pave(asphalt, road, half_m, 0.03, (8.0, 8.0))

        end_m = road.length_m - road.width_m
        for along_m in np.arange(road.width_m, end_m, 2 * _DASH_M).tolist():
            dash = Road(road.name, road.point(along_m), road.point(along_m + _DASH_M))
            _pave(lines, dash, 0.08, 0.045, (1.0, 4.0))

    return pavements, asphalt, lines


def grass() -> Mesh:
    """Return the ground around and between the streets."""
    mesh = Mesh()
    area = (-GROUND_M, -GROUND_M, GROUND_M, GROUND_M)
    mesh.level(area, 0.0, GRASS_TILE_M, 20.0)

    return mesh


def _pave(mesh: Mesh, road: Road, reach_m: float, z_m: float, grain_m: tuple[float, float]) -> None:
    """Cover the ground within `reach_m` of a road, ends squared off; `grain_m` holds `tile_m` and
    `cell_m` as in `Mesh`.
    """
    tile_m, cell_m = grain_m
    if road.is_along_an_axis:
        mesh.level(road.area(reach_m), z_m, tile_m, cell_m)
        return

    for start_m, stop_m in pairwise(cuts(-reach_m, road.length_m + reach_m, cell_m)):
        corners: list[Point] = [
            road.point(start_m, -reach_m),
            road.point(stop_m, -reach_m),
            road.point(stop_m, reach_m),
            road.point(start_m, reach_m),
        ]
        mesh.floor(corners, z_m, tile_m)


def sky() -> tuple[Mesh, Image]:
    """Return a ring of distant hills under clouds, with a lid, seen from inside."""
    rim: list[Point] = []
    for angle_rad in np.linspace(0, math.tau, _SEGMENTS + 1).tolist():
        rim.append((_SKY_M * math.cos(angle_rad), _SKY_M * math.sin(angle_rad)))

    mesh = Mesh()
    up = (0.0, 0.0, 1.0)
    for number, (start, end) in enumerate(pairwise(rim)):
        left = number / _SEGMENTS
        right = (number + 1) / _SEGMENTS
        foot_start: Vertex = (*start, 0.0)
        foot_end: Vertex = (*end, 0.0)
        top_start: Vertex = (*start, _SKY_TOP_M)
        top_end: Vertex = (*end, _SKY_TOP_M)

        wall = [foot_end, foot_start, top_start, top_end]
        mesh.polygon(wall, [(right, 1.0), (left, 1.0), (left, 0.02), (right, 0.02)], up)

        lid = [top_end, top_start, (0.0, 0.0, _SKY_TOP_M)]
        mesh.polygon(lid, [(right, 0.02), (left, 0.02), (left, 0.02)], up)

    return mesh, panorama()


def panorama() -> Image:
    """Draw the sky around the horizon, seamless: its waves and clouds are periodic."""
    rng = np.random.default_rng(5)
    height_px, width_px = _PANORAMA_PX
    air = _air(rng, height_px // 4, width_px // 4)
    picture = cv2.resize(air, (width_px, height_px), interpolation=cv2.INTER_LINEAR)

    height = np.linspace(1, 0, height_px)[:, None]
    angle_rad = np.linspace(0, math.tau, width_px, endpoint=False)
    k = np.arange(2, 30)[:, None]
    for base, colour in _HILLS:
        amplitude = rng.uniform(0.2, 1, k.shape) * 0.03 / k**0.8
        phase_rad = rng.uniform(0, math.tau, k.shape)
        waves = amplitude * np.sin(k * angle_rad + phase_rad)
        picture[height < base + waves.sum(axis=0)] = colour

    pixels = np.clip(picture, 0, 255).astype(np.uint8)
    return roughen(pixels, rng, 0.02)


def _air(rng: np.random.Generator, tall: int, wide: int) -> Singles:
    """Return blue, paler towards the horizon, with clouds, float32 (tall, wide, 3)."""
    height = np.linspace(1, 0, tall)[:, None]
    angle_rad = np.linspace(0, math.tau, wide, endpoint=False)

    # Clouds are a sum of waves around the horizon, which lean with height; there are none low down.
    clouds = np.zeros((tall, wide))
    for k in range(1, 24):
        phase_rad = rng.uniform(0, math.tau)
        lean_rad = rng.uniform(-30, 30) * height
        clouds += np.sin(k * angle_rad + phase_rad + lean_rad) / k**0.6

    is_high = np.clip(height[..., None] * 6 - 0.6, 0, 1)
    density = np.clip(clouds - 0.9, 0, 1)
    mist = 0.75 * density[..., None] * is_high

    blueness = height[..., None] ** 0.5
    clear = np.asarray(_ZENITH) * blueness + np.asarray(_HORIZON) * (1 - blueness)
    air = clear * (1 - mist) + 250 * mist
    return air.astype(np.float32)
