"""Surfaces with pictures on them: buildings, ground and sky as triangles with texture coordinates. Pure."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, field

import numpy as np

from services.sim.catalogue import BuildingType
from services.sim.facade import PX_PER_M, Image, roughen, side
from services.sim.town import PAVEMENT_WIDTH_M, STREET_WIDTH_M, Road

Vertex = tuple[float, float, float]
UV = tuple[float, float]
GROUND_M = 200.0
SKY_M = 140.0
_ROOF_RISE_M = 2.2


@dataclass
class Mesh:
    """Triangles; uv (0, 0) is a picture's upper left corner."""

    vertices: list[Vertex] = field(default_factory=list)
    uvs: list[UV] = field(default_factory=list)
    normals: list[Vertex] = field(default_factory=list)
    indices: list[int] = field(default_factory=list)

    def polygon(self, corners: list[Vertex], uvs: list[UV], normal: Vertex | None = None) -> None:
        """Add a convex polygon, its corners counter-clockwise as seen from its front."""
        if normal is None:
            edges = np.asarray(corners[1]) - corners[0], np.asarray(corners[2]) - corners[0]
            across = np.cross(*edges)
            normal = tuple(float(c) for c in across / np.linalg.norm(across))  # type: ignore[assignment]
        first = len(self.vertices)
        self.vertices += corners
        self.uvs += uvs
        self.normals += [normal] * len(corners)  # type: ignore[list-item]
        for second in range(1, len(corners) - 1):
            self.indices += [first, first + second, first + second + 1]

    def obj(self) -> str:
        """The text of a Wavefront OBJ file."""
        lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in self.vertices]
        lines += [f"vt {u:.6f} {1 - v:.6f}" for u, v in self.uvs]
        lines += [f"vn {x:.4f} {y:.4f} {z:.4f}" for x, y, z in self.normals]
        corners = [f"{i + 1}/{i + 1}/{i + 1}" for i in self.indices]
        lines += [f"f {' '.join(corners[i : i + 3])}" for i in range(0, len(corners), 3)]
        return "\n".join(lines) + "\n"

    def flat(self, west: float, south: float, east: float, north: float, z_m: float, tile_m: float, cell_m: float) -> None:
        """Add a level rectangle in cells of at most `cell_m`, its picture repeated every `tile_m` of the plane."""
        columns, rows = math.ceil((east - west) / cell_m), math.ceil((north - south) / cell_m)
        xs, ys = np.linspace(west, east, columns + 1).tolist(), np.linspace(south, north, rows + 1).tolist()
        for x0, x1 in zip(xs, xs[1:], strict=False):
            for y0, y1 in zip(ys, ys[1:], strict=False):
                corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
                self.polygon([(x, y, z_m) for x, y in corners], [(x / tile_m, -y / tile_m) for x, y in corners])


def building(kind: BuildingType) -> tuple[Mesh, Image]:
    """A building around the origin of its ground plan, width along x, front to -y, and the picture on it."""
    w, d, h = kind.width_m / 2, kind.depth_m / 2, kind.height_m
    eaves = h - _ROOF_RISE_M if kind.roof_shape == "gable" else h
    sides = [((-w, -d), (w, -d)), ((w, -d), (w, d)), ((w, d), (-w, d)), ((-w, d), (-w, -d))]
    pictures = [side(kind, math.dist(a, b), h, number == 0, number) for number, (a, b) in enumerate(sides)]
    pictures.append(_roof(kind))
    atlas, lefts = _side_by_side(pictures)
    mesh = Mesh()

    def uv(number: int, along_m: float, z_m: float) -> UV:
        tall, wide = atlas.shape[:2]
        return (lefts[number] + along_m * PX_PER_M) / wide, (h - z_m) * PX_PER_M / tall

    for number, (a, b) in enumerate(sides):
        length = math.dist(a, b)
        outline = [(0.0, 0.0), (length, 0.0), (length, eaves), (0.0, eaves)]
        if eaves < h and number % 2 == 1:
            outline.insert(3, (length / 2, h))
        unit = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        corners = [(a[0] + s * unit[0], a[1] + s * unit[1], z) for s, z in outline]
        mesh.polygon(corners, [uv(number, s, z) for s, z in outline])
    _cover(mesh, w, d, eaves, h, [uv(4, s, h - t) for s, t in ((0, 2 * d), (2 * w, 2 * d), (2 * w, 0), (0, 0))])
    return mesh, atlas


def _cover(mesh: Mesh, w: float, d: float, eaves: float, ridge: float, uvs: list[UV]) -> None:
    if eaves == ridge:
        mesh.polygon([(-w, -d, ridge), (w, -d, ridge), (w, d, ridge), (-w, d, ridge)], uvs)
        return
    mesh.polygon([(-w, -d, eaves), (w, -d, eaves), (w, 0, ridge), (-w, 0, ridge)], uvs)
    mesh.polygon([(w, d, eaves), (-w, d, eaves), (-w, 0, ridge), (w, 0, ridge)], uvs)


def _roof(kind: BuildingType) -> Image:
    rng = np.random.default_rng([zlib.crc32(kind.name.encode()), 4])
    picture = np.empty((round(kind.depth_m * PX_PER_M), round(kind.width_m * PX_PER_M), 3), np.uint8)
    picture[:] = kind.roof
    picture[:: PX_PER_M // 2] = (0.75 * np.asarray(kind.roof)).astype(np.uint8)
    return roughen(picture, rng)


def _side_by_side(pictures: list[Image]) -> tuple[Image, list[int]]:
    """One picture with all of them in a row, and where each begins, in pixels."""
    lefts = np.cumsum([0] + [picture.shape[1] for picture in pictures])
    # OpenGL wants rows of whole words: a width that 4 divides.
    row = np.zeros((max(p.shape[0] for p in pictures), -4 * (-int(lefts[-1]) // 4), 3), np.uint8)
    for left, picture in zip(lefts, pictures, strict=False):
        row[: picture.shape[0], left : left + picture.shape[1]] = picture
    return row, [int(left) for left in lefts]


def ground(roads: tuple[Road, ...]) -> list[tuple[Mesh, Image]]:
    """Grass, pavements, asphalt and the lines on it, from below upwards, each with its picture."""
    rng = np.random.default_rng(11)
    grass, pavement, asphalt, lines = Mesh(), Mesh(), Mesh(), Mesh()
    grass.flat(-GROUND_M, -GROUND_M, GROUND_M, GROUND_M, 0.0, 8.0, 20.0)
    for road in roads:
        pavement.flat(*road.area(STREET_WIDTH_M / 2 + PAVEMENT_WIDTH_M), 0.015, 4.0, 8.0)
        asphalt.flat(*road.area(STREET_WIDTH_M / 2), 0.03, 8.0, 8.0)
        _dashes(lines, road)
    slabs = np.full((128, 128, 3), (188, 180, 168), np.uint8)
    slabs[::32] = slabs[:, ::32] = (140, 134, 126)
    return [
        (grass, roughen(np.full((512, 512, 3), (104, 138, 66), np.uint8), rng, 0.2)),
        (pavement, roughen(slabs, rng, 0.1)),
        (asphalt, roughen(np.full((512, 512, 3), (92, 92, 98), np.uint8), rng, 0.15)),
        (lines, roughen(np.full((64, 64, 3), (232, 230, 220), np.uint8), rng, 0.06)),
    ]


def _dashes(mesh: Mesh, road: Road) -> None:
    length_m = math.dist(road.start, road.end)
    unit = (road.end[0] - road.start[0]) / length_m, (road.end[1] - road.start[1]) / length_m
    for s in np.arange(STREET_WIDTH_M, length_m - STREET_WIDTH_M, 4.0).tolist():
        ends = [(road.start[0] + t * unit[0], road.start[1] + t * unit[1]) for t in (s, s + 2.0)]
        (x0, y0), (x1, y1) = ends
        mesh.flat(min(x0, x1) - 0.08, min(y0, y1) - 0.08, max(x0, x1) + 0.08, max(y0, y1) + 0.08, 0.045, 1.0, 4.0)


def sky() -> tuple[Mesh, Image]:
    """A ring of distant hills under clouds, with a lid, seen from inside."""
    mesh, segments, top_m = Mesh(), 24, 120.0
    angles = np.linspace(0, math.tau, segments + 1).tolist()
    rim = [(SKY_M * math.cos(a), SKY_M * math.sin(a)) for a in angles]
    up = (0.0, 0.0, 1.0)
    for i, ((x0, y0), (x1, y1)) in enumerate(zip(rim, rim[1:], strict=False)):
        u0, u1 = i / segments, (i + 1) / segments
        wall: list[Vertex] = [(x1, y1, 0.0), (x0, y0, 0.0), (x0, y0, top_m), (x1, y1, top_m)]
        mesh.polygon(wall, [(u1, 1.0), (u0, 1.0), (u0, 0.02), (u1, 0.02)], up)
        mesh.polygon([(x1, y1, top_m), (x0, y0, top_m), (0.0, 0.0, top_m)], [(u1, 0.02), (u0, 0.02), (u0, 0.02)], up)
    return mesh, _panorama()


def _panorama() -> Image:
    """Sky around the horizon, uint8 (512, 2048, 3), seamless: its waves and clouds are periodic."""
    rng = np.random.default_rng(5)
    tall, wide = 512, 2048
    angle = np.linspace(0, math.tau, wide, endpoint=False)
    height = np.linspace(1, 0, tall)[:, None]
    blue, pale = np.asarray((118, 170, 226)), np.asarray((214, 228, 238))
    picture = (blue * height[..., None] ** 0.5 + pale * (1 - height[..., None] ** 0.5)) * np.ones((tall, wide, 1))
    clouds = np.zeros((tall, wide))
    for k in range(1, 24):
        phase, tilt = rng.uniform(0, math.tau), rng.uniform(-30, 30)
        clouds += np.sin(k * angle[None] + phase + tilt * height) / k**0.6
    mist = np.clip(clouds - 0.9, 0, 1)[..., None] * np.clip(height[..., None] * 6 - 0.6, 0, 1)
    picture = picture * (1 - 0.75 * mist) + 250 * 0.75 * mist
    for base, colour in ((0.105, (140, 164, 170)), (0.07, (104, 138, 112))):
        crest = base + sum(rng.uniform(0.2, 1) * 0.03 / k**0.8 * np.sin(k * angle + rng.uniform(0, 6.3)) for k in range(2, 30))
        picture[height[:, 0][:, None] < crest[None]] = colour
    return roughen(np.clip(picture, 0, 255).astype(np.uint8), rng, 0.02)
