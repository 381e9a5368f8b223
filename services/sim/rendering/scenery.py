"""The ground and the sky of a town: grass, streets, and a sky with hills. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import cv2
import numpy as np

from cogmap.geometry.arrays import Floats, Singles
from cogmap.services.sim.layout.plan import PAVEMENT_WIDTH_M, Point, Road
from cogmap.services.sim.rendering.mesh import Mesh, Vertex
from cogmap.services.sim.rendering.wall import Image, plain, roughen

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
    """The pictures of grass, pavements, asphalt and the lines on it."""
    rng = np.random.default_rng(11)
    soil = roughen(plain(512, (104, 138, 66)), rng, 0.2)
    slabs = roughen(_slabs(), rng, 0.1)
    asphalt = roughen(plain(512, (92, 92, 98)), rng, 0.15)
    paint = roughen(plain(64, (232, 230, 220)), rng, 0.06)

    return soil, slabs, asphalt, paint


def streets(roads: Sequence[Road]) -> tuple[Mesh, Mesh, Mesh]:
    """Pavements, asphalt and the lines on it, from below upwards."""
    return _pavements(roads), _asphalt(roads), _lines(roads)


def grass() -> Mesh:
    """The ground around and between the streets."""
    mesh = Mesh()
    area = (-GROUND_M, -GROUND_M, GROUND_M, GROUND_M)
    mesh.level(area, 0.0, GRASS_TILE_M, 20.0)

    return mesh


def _pavements(roads: Sequence[Road]) -> Mesh:
    mesh = Mesh()
    for road in roads:
        reach_m = road.width_m / 2 + PAVEMENT_WIDTH_M
        _pave(mesh, road, reach_m, 0.015, (4.0, 8.0))

    return mesh


def _asphalt(roads: Sequence[Road]) -> Mesh:
    mesh = Mesh()
    for road in roads:
        _pave(mesh, road, road.width_m / 2, 0.03, (8.0, 8.0))

    return mesh


def _lines(roads: Sequence[Road]) -> Mesh:
    """Dashes along the middle of each road."""
    mesh = Mesh()
    for road in roads:
        end_m = road.length_m - road.width_m
        starts_m = np.arange(road.width_m, end_m, 2 * _DASH_M)

        for along_m in starts_m.tolist():
            dash = Road(road.name, road.point(along_m), road.point(along_m + _DASH_M))
            _pave(mesh, dash, 0.08, 0.045, (1.0, 4.0))

    return mesh


def _slabs() -> Image:
    """Pavement in squares."""
    picture = plain(128, (188, 180, 168))
    joint = (140, 134, 126)
    picture[::32] = joint
    picture[:, ::32] = joint

    return picture


def _pave(mesh: Mesh, road: Road, reach_m: float, z_m: float, grain_m: tuple[float, float]) -> None:
    """Cover what lies within `reach_m` of a road, ends squared off; `grain_m`: as of tiles and
    cells in `Mesh`.
    """
    tile_m, cell_m = grain_m
    if road.is_along_an_axis:
        mesh.level(road.area(reach_m), z_m, tile_m, cell_m)
        return

    for start_m, stop_m in pairwise(_cuts_m(road, reach_m, cell_m)):
        corners: list[Point] = [
            road.point(start_m, -reach_m),
            road.point(stop_m, -reach_m),
            road.point(stop_m, reach_m),
            road.point(start_m, reach_m),
        ]
        mesh.floor(corners, z_m, tile_m)


def _cuts_m(road: Road, reach_m: float, cell_m: float) -> list[float]:
    """Where a road, with `reach_m` at either end, is cut to cells of `cell_m` at most."""
    end_m = road.length_m + reach_m
    length_m = road.length_m + 2 * reach_m
    cells = math.ceil(length_m / cell_m)

    cuts_m: list[float] = np.linspace(-reach_m, end_m, cells + 1).tolist()
    return cuts_m


def sky() -> tuple[Mesh, Image]:
    """A ring of distant hills under clouds, with a lid, seen from inside."""
    mesh = Mesh()
    for number, (start, end) in enumerate(pairwise(_rim())):
        _add_segment(mesh, number, start, end)

    return mesh, _panorama()


def _rim() -> list[Point]:
    """The corners of the ring, the first again at its end."""
    rim = []
    for angle_rad in np.linspace(0, math.tau, _SEGMENTS + 1).tolist():
        x_m = _SKY_M * math.cos(angle_rad)
        y_m = _SKY_M * math.sin(angle_rad)
        rim.append((x_m, y_m))

    return rim


def _add_segment(mesh: Mesh, number: int, start: Point, end: Point) -> None:
    """A wall of the sky, and the piece of the lid above it."""
    up = (0.0, 0.0, 1.0)
    left = number / _SEGMENTS
    right = (number + 1) / _SEGMENTS

    foot_start: Vertex = (*start, 0.0)
    foot_end: Vertex = (*end, 0.0)
    top_start: Vertex = (*start, _SKY_TOP_M)
    top_end: Vertex = (*end, _SKY_TOP_M)

    wall = [foot_end, foot_start, top_start, top_end]
    wall_uvs = [(right, 1.0), (left, 1.0), (left, 0.02), (right, 0.02)]
    mesh.polygon(wall, wall_uvs, up)

    lid = [top_end, top_start, (0.0, 0.0, _SKY_TOP_M)]
    lid_uvs = [(right, 0.02), (left, 0.02), (left, 0.02)]
    mesh.polygon(lid, lid_uvs, up)


def _panorama() -> Image:
    """Sky around the horizon, seamless: its waves and clouds are periodic."""
    rng = np.random.default_rng(5)
    height_px, width_px = _PANORAMA_PX
    air = _air(rng, height_px // 4, width_px // 4)
    size = (width_px, height_px)
    picture = cv2.resize(air, size, interpolation=cv2.INTER_LINEAR)

    height = np.linspace(1, 0, height_px)[:, None]
    for base, colour in _HILLS:
        is_hill = height < _crest(base, rng)
        picture[is_hill] = colour

    pixels = np.clip(picture, 0, 255).astype(np.uint8)
    return roughen(pixels, rng, 0.02)


def _air(rng: np.random.Generator, tall: int, wide: int) -> Singles:
    """Blue, paler towards the horizon, with clouds, float32 (tall, wide, 3)."""
    height = np.linspace(1, 0, tall)[:, None]
    mist = _mist(rng, height, wide)

    blueness = height[..., None] ** 0.5
    blue = np.asarray(_ZENITH) * blueness
    pale = np.asarray(_HORIZON) * (1 - blueness)
    clear = blue + pale

    air = clear * (1 - mist) + 250 * mist
    return air.astype(np.float32)


def _mist(rng: np.random.Generator, height: Floats, wide: int) -> Floats:
    """(tall, wide, 1): how much of the clear air clouds hide, none low down."""
    clouds = _clouds(rng, height, wide)
    is_high = np.clip(height[..., None] * 6 - 0.6, 0, 1)

    density = np.clip(clouds - 0.9, 0, 1)
    mist: Floats = 0.75 * density[..., None] * is_high
    return mist


def _clouds(rng: np.random.Generator, height: Floats, wide: int) -> Floats:
    """A sum of waves around the horizon, which lean with height."""
    angle_rad = np.linspace(0, math.tau, wide, endpoint=False)
    clouds = np.zeros((len(height), wide))

    for k in range(1, 24):
        phase_rad = rng.uniform(0, math.tau)
        lean_rad = rng.uniform(-30, 30) * height

        wave = np.sin(k * angle_rad + phase_rad + lean_rad)
        clouds += wave / k**0.6

    return clouds


def _crest(base: float, rng: np.random.Generator) -> Floats:
    """The height of hills around the horizon, as a share of the picture's."""
    angle_rad = np.linspace(0, math.tau, _PANORAMA_PX[1], endpoint=False)
    k = np.arange(2, 30)[:, None]

    amplitude = rng.uniform(0.2, 1, k.shape) * 0.03 / k**0.8
    phase_rad = rng.uniform(0, math.tau, k.shape)
    waves = amplitude * np.sin(k * angle_rad + phase_rad)

    crest: Floats = base + waves.sum(axis=0)

    return crest
