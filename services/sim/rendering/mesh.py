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
_ROOF_RISE_M = 2.2
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
            normal = _normal(corners)

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
        columns = pairwise(_cuts(west, east, cell_m))
        rows = pairwise(_cuts(south, north, cell_m))

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
        """The text of a Wavefront OBJ file."""
        lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in self.vertices]
        lines += [f"vt {u:.6f} {1 - v:.6f}" for u, v in self.uvs]
        lines += [f"vn {x:.4f} {y:.4f} {z:.4f}" for x, y, z in self.normals]

        for corners in self.triangles:
            numbers = [corner + 1 for corner in corners]
            references = [f"{n}/{n}/{n}" for n in numbers]
            lines.append("f " + " ".join(references))

        return "\n".join(lines) + "\n"


def building(kind: BuildingType) -> tuple[Mesh, Image]:
    """A building around the origin of its ground plan, width along x, front to -y, and the picture
    on it.
    """
    shell = _Shell(kind)
    for number in range(4):
        shell.add_side(number)

    shell.add_roof()

    return shell.mesh, shell.atlas


def prism(kind: BuildingType, outline: Sequence[Point]) -> tuple[Mesh, Image]:
    """The walls of a building over its outline, counter-clockwise, and the picture on all of them:
    a bay that is repeated. Its roof is flat, and seen by nobody in the street.
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


class _Shell:
    """The sides and the roof of a building as they are built, and one picture for all of them."""

    def __init__(self, kind: BuildingType) -> None:
        self.mesh = Mesh()
        self._half_width_m = kind.width_m / 2
        self._half_depth_m = kind.depth_m / 2
        self._height_m = kind.height_m
        self._is_gabled = kind.roof_shape == "gable"
        self._eaves_m = kind.height_m - _ROOF_RISE_M if self._is_gabled else kind.height_m

        w = self._half_width_m
        d = self._half_depth_m
        self._corners: list[Point] = [(-w, -d), (w, -d), (w, d), (-w, d), (-w, -d)]
        self.atlas, self._lefts = _side_by_side(self._pictures(kind))

    def _pictures(self, kind: BuildingType) -> list[Image]:
        """The pictures of the walls, and that of the roof."""
        pictures = []
        for number, (start, end) in enumerate(pairwise(self._corners)):
            length_m = math.dist(start, end)
            pictures.append(facade.side(kind, length_m, number))

        return [*pictures, facade.roof(kind)]

    def add_side(self, number: int) -> None:
        """Wall `number`; with a gable, those at the sides have one."""
        start = self._corners[number]
        end = self._corners[number + 1]
        length_m = math.dist(start, end)

        vertices: list[Vertex] = []
        uvs = []
        for along_m, up_m in self._outline(number, length_m):
            x_m, y_m = _along(start, end, along_m)
            vertices.append((x_m, y_m, up_m))
            uvs.append(self._uv(number, along_m, self._height_m - up_m))

        self.mesh.polygon(vertices, uvs)

    def add_roof(self) -> None:
        """A flat roof, or the two halves of a gabled one."""
        half_width_m = self._half_width_m
        half_depth_m = self._half_depth_m
        ridge_y = 0.0 if self._is_gabled else half_depth_m
        uvs = self._roof_uvs(ridge_y)

        front = self._slope((-half_width_m, -half_depth_m), (half_width_m, ridge_y))
        self.mesh.polygon(front, uvs)
        if self._is_gabled:
            back = self._slope((half_width_m, half_depth_m), (-half_width_m, 0))
            self.mesh.polygon(back, uvs)

    def _slope(self, eaves: Point, ridge: Point) -> list[Vertex]:
        """A rectangle of the roof, between opposite corners at the eaves and at the ridge."""
        eaves_x, eaves_y = eaves
        ridge_x, ridge_y = ridge
        return [
            (eaves_x, eaves_y, self._eaves_m),
            (ridge_x, eaves_y, self._eaves_m),
            (ridge_x, ridge_y, self._height_m),
            (eaves_x, ridge_y, self._height_m),
        ]

    def _outline(self, number: int, length_m: float) -> list[Point]:
        """The corners of a wall: along it, and up."""
        eaves_m = self._eaves_m
        outline = [
            (0.0, 0.0),
            (length_m, 0.0),
            (length_m, eaves_m),
            (0.0, eaves_m),
        ]
        if self._is_gabled and number % 2 == 1:
            outline.insert(3, (length_m / 2, self._height_m))

        return outline

    def _roof_uvs(self, ridge_y: float) -> list[UV]:
        width_m = 2 * self._half_width_m
        eaves_m = 2 * self._half_depth_m
        ridge_m = self._half_depth_m - ridge_y

        corners = ((0, eaves_m), (width_m, eaves_m), (width_m, ridge_m), (0, ridge_m))
        return [self._uv(_ROOF, along_m, down_m) for along_m, down_m in corners]

    def _uv(self, number: int, along_m: float, down_m: float) -> UV:
        """The point of picture `number` in the atlas."""
        height_px, width_px, _ = self.atlas.shape

        column = self._lefts[number] + along_m * PX_PER_M
        row = down_m * PX_PER_M

        return column / width_px, row / height_px


def _cuts(start: float, end: float, cell_m: float) -> list[float]:
    """Where a stretch is cut to cells of `cell_m` at most."""
    length = end - start
    cells = math.ceil(length / cell_m)
    cuts: list[float] = np.linspace(start, end, cells + 1).tolist()
    return cuts


def _along(start: Point, end: Point, along_m: float) -> Point:
    """The point `along_m` from `start` towards `end`."""
    start_x, start_y = start
    end_x, end_y = end
    length_m = math.dist(start, end)

    x_m = start_x + along_m * ((end_x - start_x) / length_m)
    y_m = start_y + along_m * ((end_y - start_y) / length_m)
    return x_m, y_m


def _normal(corners: list[Vertex]) -> Vertex:
    a, b, c = np.asarray(corners[:3])
    across = np.cross(b - a, c - a)

    length = np.linalg.norm(across)
    x, y, z = (across / length).tolist()

    return x, y, z


def _side_by_side(pictures: list[Image]) -> tuple[Image, list[int]]:
    """One picture with all of them in a row, and where each begins, in pixels."""
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
