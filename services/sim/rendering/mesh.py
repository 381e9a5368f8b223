"""Triangles with pictures on them. Pure."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from cogmap.services.sim.layout.catalogue import BuildingType
from cogmap.services.sim.layout.plan import Point, Rectangle
from cogmap.services.sim.rendering import facade
from cogmap.services.sim.rendering.wall import PX_PER_M, Image

Vertex = tuple[float, float, float]
UV = tuple[float, float]
# Looks: the roof's picture; the wall that is repeated around an outline.
_ROOF = 4
_BAY_M = 8.0


@dataclass
class Mesh:
    """Triangles; uv (0, 0) is a picture's upper left corner; it repeats beyond (1, 1)."""

    vertices: list[Vertex] = field(default_factory=list)
    uvs: list[UV] = field(default_factory=list)
    normals: list[Vertex] = field(default_factory=list)
    triangles: list[tuple[int, int, int]] = field(default_factory=list)

    def polygon(self, corners: list[Vertex], uvs: list[UV], normal: Vertex | None = None) -> None:
        """Add a convex polygon, its corners counter-clockwise as seen from its front."""
        first = len(self.vertices)
        if normal is None:
            normal = _normal(*corners[:3])

        self.vertices += corners
        self.uvs += uvs
        self.normals += [normal] * len(corners)

        last = first + len(corners) - 1
        for number in range(first + 1, last):
            self.triangles.append((first, number, number + 1))

    def level(self, area: Rectangle, z_m: float, tile_m: float, cell_m: float) -> None:
        """Add `area` (west, south, east, north) at `z_m`, cut to cells, its picture repeated every
        `tile_m`.
        """
        west, south, east, north = area
        columns = pairwise(cuts(west, east, cell_m))
        rows = pairwise(cuts(south, north, cell_m))

        for (x0, x1), (y0, y1) in itertools.product(columns, rows):
            corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
            self.floor(corners, z_m, tile_m)

    def floor(self, corners: list[Point], z_m: float, tile_m: float) -> None:
        """Add a level polygon at `z_m`, its picture repeated every `tile_m`."""
        vertices: list[Vertex] = []
        uvs: list[UV] = []
        for x, y in corners:
            vertices.append((x, y, z_m))
            uvs.append((x / tile_m, -y / tile_m))

        self.polygon(vertices, uvs)

    def obj(self) -> str:
        """Format the mesh as the text of a Wavefront OBJ file."""
        lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in self.vertices]
        lines += [f"vt {u:.6f} {1 - v:.6f}" for u, v in self.uvs]
        lines += [f"vn {x:.4f} {y:.4f} {z:.4f}" for x, y, z in self.normals]

        for corners in self.triangles:
            numbers = [corner + 1 for corner in corners]
            references = [f"{n}/{n}/{n}" for n in numbers]
            lines.append("f " + " ".join(references))

        return "\n".join(lines) + "\n"


def building(kind: BuildingType) -> tuple[Mesh, Image]:
    """Return a building around the origin of its ground plan, width along x, front to -y, and the
    picture on it: its four sides and its roof in a row.
    """
    half_width_m = kind.width_m / 2
    half_depth_m = kind.depth_m / 2
    height_m = kind.height_m
    is_gabled = kind.roof_rise_m > 0
    eaves_m = height_m - kind.roof_rise_m

    corners: list[Point] = [
        (-half_width_m, -half_depth_m),
        (half_width_m, -half_depth_m),
        (half_width_m, half_depth_m),
        (-half_width_m, half_depth_m),
    ]
    sides = list(pairwise([*corners, corners[0]]))
    lengths_m = [math.dist(start, end) for start, end in sides]
    pictures = [facade.side(kind, length_m, number) for number, length_m in enumerate(lengths_m)]
    atlas, lefts = _side_by_side([*pictures, facade.roof(kind)])

    def uv(number: int, along_m: float, down_m: float) -> UV:
        """Return the point of picture `number` in the atlas."""
        height_px, width_px, _ = atlas.shape
        column = lefts[number] + along_m * PX_PER_M
        return column / width_px, down_m * PX_PER_M / height_px

    mesh = Mesh()
    for number, ((start_x, start_y), (end_x, end_y)) in enumerate(sides):
        length_m = lengths_m[number]
        # Along the wall, and up; with a gable, those at the sides have one.
        outline = [(0.0, 0.0), (length_m, 0.0), (length_m, eaves_m), (0.0, eaves_m)]
        if is_gabled and number % 2 == 1:
            outline.insert(3, (length_m / 2, height_m))

        vertices: list[Vertex] = []
        uvs = []
        for along_m, up_m in outline:
            x_m = start_x + along_m * ((end_x - start_x) / length_m)
            y_m = start_y + along_m * ((end_y - start_y) / length_m)
            vertices.append((x_m, y_m, up_m))
            uvs.append(uv(number, along_m, height_m - up_m))
        mesh.polygon(vertices, uvs)

    # A flat roof, or the two halves of a gabled one.
    ridge_y = 0.0 if is_gabled else half_depth_m
    below_ridge_m = half_depth_m - ridge_y
    roof_uvs = [
        uv(_ROOF, 0, kind.depth_m),
        uv(_ROOF, kind.width_m, kind.depth_m),
        uv(_ROOF, kind.width_m, below_ridge_m),
        uv(_ROOF, 0, below_ridge_m),
    ]
    slopes = [((-half_width_m, -half_depth_m), (half_width_m, ridge_y))]
    if is_gabled:
        slopes.append(((half_width_m, half_depth_m), (-half_width_m, 0.0)))
    for (eaves_x, eaves_y), (ridge_x, far_y) in slopes:
        slope: list[Vertex] = [
            (eaves_x, eaves_y, eaves_m),
            (ridge_x, eaves_y, eaves_m),
            (ridge_x, far_y, height_m),
            (eaves_x, far_y, height_m),
        ]
        mesh.polygon(slope, roof_uvs)

    return mesh, atlas


def prism(kind: BuildingType, outline: Sequence[Point]) -> tuple[Mesh, Image]:
    """Make the walls of a building over its outline, counter-clockwise, and the picture on all of
    them: a bay that is repeated. Its roof is flat, and nobody in the street sees it.
    """
    bay = facade.side(kind, _BAY_M, 1)
    picture, _ = _side_by_side([bay])
    share = bay.shape[1] / picture.shape[1]

    mesh = Mesh()
    for start, end in pairwise([*outline, outline[0]]):
        bays = max(1, round(math.dist(start, end) / _BAY_M))
        right = bays * share
        wall = [
            (*start, 0.0),
            (*end, 0.0),
            (*end, kind.height_m),
            (*start, kind.height_m),
        ]
        mesh.polygon(wall, [(0.0, 1.0), (right, 1.0), (right, 0.0), (0.0, 0.0)])

    return mesh, picture


def cuts(start: float, end: float, cell_m: float) -> list[float]:
    """Return where a stretch is cut to cells of `cell_m` at most."""
    length = end - start
    cells = math.ceil(length / cell_m)
    edges: list[float] = np.linspace(start, end, cells + 1).tolist()
    return edges


def _normal(a: Vertex, b: Vertex, c: Vertex) -> Vertex:
    """Return the unit vector out of the front of a triangle, zero of one without an area.

    In plain numbers, as NumPy takes ten times as long for three of them.
    """
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    x = uy * vz - uz * vy
    y = uz * vx - ux * vz
    z = ux * vy - uy * vx
    length = math.sqrt(x * x + y * y + z * z) or 1.0
    return x / length, y / length, z / length


def _side_by_side(pictures: list[Image]) -> tuple[Image, list[int]]:
    """Join all pictures in a row; return the row, and where each begins, in pixels."""
    heights_px = [picture.shape[0] for picture in pictures]
    widths_px = [picture.shape[1] for picture in pictures]
    lefts = [0, *itertools.accumulate(widths_px)]

    # OpenGL needs rows of whole words: a width that 4 divides.
    words = math.ceil(lefts[-1] / 4)
    shape = (max(heights_px), 4 * words, 3)
    row = np.zeros(shape, np.uint8)

    for left, picture in zip(lefts, pictures, strict=False):
        height_px, picture_px, _ = picture.shape
        right = left + picture_px
        row[:height_px, left:right] = picture

    return row, lefts
