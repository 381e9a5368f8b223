"""What a town stands on and under: grass, streets, and a sky with hills. Pure."""

from __future__ import annotations

import itertools
import math

import cv2
import numpy as np

from services.sim.layout.plan import PAVEMENT_WIDTH_M, STREET_WIDTH_M, Road
from services.sim.rendering.mesh import Mesh, Vertex
from services.sim.rendering.wall import Image, plain, roughen

GROUND_M = 200.0
GRASS_TILE_M = 8.0
_SKY_M = 140.0
_SKY_TOP_M = 120.0
_SEGMENTS = 24
_PANORAMA_PX = (512, 2048)


def ground(roads: tuple[Road, ...]) -> list[tuple[Mesh, Image]]:
    """Grass, pavements, asphalt and the lines on it, from below upwards, each with its picture;
    none that is empty.
    """
    rng = np.random.default_rng(11)
    grass = Mesh()
    pavement = Mesh()
    asphalt = Mesh()
    lines = Mesh()
    grass.level((-GROUND_M, -GROUND_M, GROUND_M, GROUND_M), 0.0, GRASS_TILE_M, 20.0)
    for road in roads:
        _pave(pavement, road, STREET_WIDTH_M / 2 + PAVEMENT_WIDTH_M, 0.015, (4.0, 8.0))
        _pave(asphalt, road, STREET_WIDTH_M / 2, 0.03, (8.0, 8.0))
        _dashes(lines, road)
    slabs = plain(128, (188, 180, 168))
    slabs[::32] = slabs[:, ::32] = (140, 134, 126)
    surfaces = [
        (grass, roughen(plain(512, (104, 138, 66)), rng, 0.2)),
        (pavement, roughen(slabs, rng, 0.1)),
        (asphalt, roughen(plain(512, (92, 92, 98)), rng, 0.15)),
        (lines, roughen(plain(64, (232, 230, 220)), rng, 0.06)),
    ]
    return [surface for surface in surfaces if surface[0].triangles]


def _dashes(mesh: Mesh, road: Road) -> None:
    for s in np.arange(STREET_WIDTH_M, road.length_m - STREET_WIDTH_M, 4.0).tolist():
        _pave(mesh, Road(road.name, road.point(s), road.point(s + 2.0)), 0.08, 0.045, (1.0, 4.0))


def _pave(mesh: Mesh, road: Road, reach_m: float, z_m: float, grain_m: tuple[float, float]) -> None:
    """Cover what lies within `reach_m` of a road, ends squared off; `grain_m`: as of tiles and
    cells in `Mesh`.
    """
    if road.is_along_an_axis:
        mesh.level(road.area(reach_m), z_m, *grain_m)
        return
    tile_m, cell_m = grain_m
    length_m = road.length_m + 2 * reach_m
    along = np.linspace(
        -reach_m, road.length_m + reach_m, math.ceil(length_m / cell_m) + 1
    ).tolist()
    for s0, s1 in itertools.pairwise(along):
        corners = [
            road.point(s, t)
            for s, t in ((s0, -reach_m), (s1, -reach_m), (s1, reach_m), (s0, reach_m))
        ]
        mesh.polygon(
            [(x, y, z_m) for x, y in corners], [(x / tile_m, -y / tile_m) for x, y in corners]
        )


def sky() -> tuple[Mesh, Image]:
    """A ring of distant hills under clouds, with a lid, seen from inside."""
    mesh = Mesh()
    up = (0.0, 0.0, 1.0)
    angles = np.linspace(0, math.tau, _SEGMENTS + 1).tolist()
    rim = [(_SKY_M * math.cos(a), _SKY_M * math.sin(a)) for a in angles]
    for i, ((x0, y0), (x1, y1)) in enumerate(itertools.pairwise(rim)):
        u0 = i / _SEGMENTS
        u1 = (i + 1) / _SEGMENTS
        wall: list[Vertex] = [
            (x1, y1, 0.0),
            (x0, y0, 0.0),
            (x0, y0, _SKY_TOP_M),
            (x1, y1, _SKY_TOP_M),
        ]
        mesh.polygon(wall, [(u1, 1.0), (u0, 1.0), (u0, 0.02), (u1, 0.02)], up)
        lid: list[Vertex] = [(x1, y1, _SKY_TOP_M), (x0, y0, _SKY_TOP_M), (0.0, 0.0, _SKY_TOP_M)]
        mesh.polygon(lid, [(u1, 0.02), (u0, 0.02), (u0, 0.02)], up)
    return mesh, _panorama()


def _panorama() -> Image:
    """Sky around the horizon, seamless: its waves and clouds are periodic."""
    rng = np.random.default_rng(5)
    tall = _PANORAMA_PX[0] // 4
    wide = _PANORAMA_PX[1] // 4
    angle = np.linspace(0, math.tau, wide, endpoint=False)
    height = np.linspace(1, 0, tall)[:, None]
    clouds = np.zeros((tall, wide))
    for k in range(1, 24):
        clouds += (
            np.sin(k * angle + rng.uniform(0, math.tau) + rng.uniform(-30, 30) * height) / k**0.6
        )
    blueness = height[..., None] ** 0.5
    mist = (
        0.75 * np.clip(clouds - 0.9, 0, 1)[..., None] * np.clip(height[..., None] * 6 - 0.6, 0, 1)
    )
    air = np.asarray((118, 170, 226)) * blueness + np.asarray((214, 228, 238)) * (1 - blueness)
    small = (air * (1 - mist) + 250 * mist).astype(np.float32)
    picture = cv2.resize(small, _PANORAMA_PX[::-1], interpolation=cv2.INTER_LINEAR)
    for base, colour in ((0.105, (140, 164, 170)), (0.07, (104, 138, 112))):
        picture[np.linspace(1, 0, _PANORAMA_PX[0])[:, None] < _crest(base, rng)] = colour
    return roughen(np.clip(picture, 0, 255).astype(np.uint8), rng, 0.02)


def _crest(base: float, rng: np.random.Generator) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """The height of hills around the horizon, as a share of the picture's."""
    angle = np.linspace(0, math.tau, _PANORAMA_PX[1], endpoint=False)
    k = np.arange(2, 30)[:, None]
    waves = (
        rng.uniform(0.2, 1, k.shape)
        * 0.03
        / k**0.8
        * np.sin(k * angle + rng.uniform(0, math.tau, k.shape))
    )
    crest: np.ndarray[tuple[int], np.dtype[np.float64]] = base + waves.sum(axis=0)
    return crest
