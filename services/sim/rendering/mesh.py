"""Triangles with pictures on them. Pure."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np

from services.sim.layout.catalogue import BuildingType
from services.sim.rendering import facade
from services.sim.rendering.wall import PX_PER_M, Image

Vertex = tuple[float, float, float]
UV = tuple[float, float]
Rectangle = tuple[float, float, float, float]
_ROOF_RISE_M = 2.2


@dataclass
class Mesh:
    """Triangles; uv (0, 0) is a picture's upper left corner, and the picture repeats beyond (1, 1)."""

    vertices: list[Vertex] = field(default_factory=list)
    uvs: list[UV] = field(default_factory=list)
    normals: list[Vertex] = field(default_factory=list)
    triangles: list[tuple[int, int, int]] = field(default_factory=list)

    def polygon(self, corners: list[Vertex], uvs: list[UV], normal: Vertex | None = None) -> None:
        """Add a convex polygon, its corners counter-clockwise as seen from its front."""
        first = len(self.vertices)
        self.vertices += corners
        self.uvs += uvs
        self.normals += [normal or _normal(corners)] * len(corners)
        self.triangles += [(first, first + i, first + i + 1) for i in range(1, len(corners) - 1)]

    def level(self, area: Rectangle, z_m: float, tile_m: float, cell_m: float) -> None:
        """Add `area` (west, south, east, north) at `z_m`, cut to cells, its picture repeated every
        `tile_m`.
        """
        west, south, east, north = area
        xs = np.linspace(west, east, math.ceil((east - west) / cell_m) + 1).tolist()
        ys = np.linspace(south, north, math.ceil((north - south) / cell_m) + 1).tolist()
        for x0, x1 in itertools.pairwise(xs):
            for y0, y1 in itertools.pairwise(ys):
                corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
                self.polygon(
                    [(x, y, z_m) for x, y in corners],
                    [(x / tile_m, -y / tile_m) for x, y in corners],
                )

    def obj(self) -> str:
        """The text of a Wavefront OBJ file."""
        lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in self.vertices]
        lines += [f"vt {u:.6f} {1 - v:.6f}" for u, v in self.uvs]
        lines += [f"vn {x:.4f} {y:.4f} {z:.4f}" for x, y, z in self.normals]
        lines += [
            "f " + " ".join(f"{i + 1}/{i + 1}/{i + 1}" for i in corners)
            for corners in self.triangles
        ]
        return "\n".join(lines) + "\n"


def building(kind: BuildingType) -> tuple[Mesh, Image]:
    """A building around the origin of its ground plan, width along x, front to -y, and the picture
    on it.
    """
    w = kind.width_m / 2
    d = kind.depth_m / 2
    h = kind.height_m
    eaves = h - _ROOF_RISE_M if kind.roof_shape == "gable" else h
    corners = [(-w, -d), (w, -d), (w, d), (-w, d)]
    sides = list(itertools.pairwise([*corners, corners[0]]))
    pictures = [facade.side(kind, math.dist(a, b), number) for number, (a, b) in enumerate(sides)]
    atlas, lefts = _side_by_side([*pictures, facade.roof(kind)])

    def uv(number: int, along_m: float, down_m: float) -> UV:
        return (lefts[number] + along_m * PX_PER_M) / atlas.shape[
            1
        ], down_m * PX_PER_M / atlas.shape[0]

    mesh = Mesh()
    for number, (a, b) in enumerate(sides):
        length = math.dist(a, b)
        outline = [(0.0, 0.0), (length, 0.0), (length, eaves), (0.0, eaves)]
        if eaves < h and number % 2 == 1:
            outline.insert(3, (length / 2, h))
        unit = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        wall = [(a[0] + s * unit[0], a[1] + s * unit[1], z) for s, z in outline]
        mesh.polygon(wall, [uv(number, s, h - z) for s, z in outline])
    ridge_y = 0.0 if eaves < h else d
    cover = [
        uv(4, s, t) for s, t in ((0, 2 * d), (2 * w, 2 * d), (2 * w, d - ridge_y), (0, d - ridge_y))
    ]
    mesh.polygon([(-w, -d, eaves), (w, -d, eaves), (w, ridge_y, h), (-w, ridge_y, h)], cover)
    if eaves < h:
        mesh.polygon([(w, d, eaves), (-w, d, eaves), (-w, 0, h), (w, 0, h)], cover)
    return mesh, atlas


def _normal(corners: list[Vertex]) -> Vertex:
    a, b, c = np.asarray(corners[:3])
    across = np.cross(b - a, c - a)
    x, y, z = (across / np.linalg.norm(across)).tolist()
    return x, y, z


def _side_by_side(pictures: list[Image]) -> tuple[Image, list[int]]:
    """One picture with all of them in a row, and where each begins, in pixels."""
    lefts = [0, *itertools.accumulate(picture.shape[1] for picture in pictures)]
    # OpenGL wants rows of whole words: a width that 4 divides.
    row = np.zeros((max(p.shape[0] for p in pictures), math.ceil(lefts[-1] / 4) * 4, 3), np.uint8)
    for left, picture in zip(lefts, pictures, strict=False):
        row[: picture.shape[0], left : left + picture.shape[1]] = picture
    return row, lefts
