"""Façades: a picture for each side of a building, drawn from its type. Pure, and the same in every
town.
"""

from __future__ import annotations

import zlib

import numpy as np

from services.sim.layout.catalogue import BuildingType, Colour
from services.sim.rendering.patterns import PAINT, STOREY_M
from services.sim.rendering.wall import PX_PER_M, Image, Wall, roughen, shaded

_GLASS: Colour = (58, 74, 96)
_PLINTH_M = 0.5


def side(kind: BuildingType, width_m: float, number: int) -> Image:
    """Wall `number` of a building, uint8 (height, width, 3): number 0 is the front and has the
    door.
    """
    rng = _generator(kind, number)
    wall = Wall(kind, width_m, kind.height_m)
    if kind.pattern in PAINT:
        PAINT[kind.pattern](wall)
    _windows(wall, number == 0, rng)
    if number == 0:
        _entrance(wall)
    wall.box(0, 0, width_m, _PLINTH_M, shaded(kind.wall, 0.55))
    return roughen(wall.image, rng)


def roof(kind: BuildingType) -> Image:
    """The roof from above, uint8 (depth, width, 3), in courses."""
    picture = np.full(
        (round(kind.depth_m * PX_PER_M), round(kind.width_m * PX_PER_M), 3), kind.roof, np.uint8
    )
    picture[:: PX_PER_M // 2] = shaded(kind.roof, 0.75)
    return roughen(picture, _generator(kind, 4))


def _generator(kind: BuildingType, number: int) -> np.random.Generator:
    return np.random.default_rng([zlib.crc32(kind.name.encode()), number])


def _windows(wall: Wall, front: bool, rng: np.random.Generator) -> None:
    columns = max(2, int(wall.width_m / 2.6))
    for storey in range(max(1, int((wall.height_m - 0.6) / STOREY_M))):
        for column in range(columns):
            middle_m = (column + 0.5) * wall.width_m / columns
            if front and storey == 0 and abs(middle_m - wall.width_m / 2) < 1.7:
                continue
            _window(wall, middle_m, storey * STOREY_M + 1.0, float(rng.uniform(0.7, 1.5)))


def _window(wall: Wall, middle_m: float, sill_m: float, shade: float) -> None:
    trim = wall.kind.trim
    wall.box(middle_m - 0.6, sill_m - 0.1, 1.2, 1.6, trim)
    wall.box(middle_m - 0.48, sill_m, 0.96, 1.4, shaded(_GLASS, shade))
    wall.box(middle_m - 0.05, sill_m, 0.1, 1.4, trim)
    wall.box(middle_m - 0.48, sill_m + 0.85, 0.96, 0.1, trim)
    if wall.kind.pattern == "shutters":
        for x_m in (middle_m - 1.2, middle_m + 0.6):
            wall.box(x_m, sill_m - 0.1, 0.6, 1.6, wall.kind.accent)


def _entrance(wall: Wall) -> None:
    middle_m = wall.width_m / 2
    kind = wall.kind
    if kind.pattern == "gates":
        for x_m in (middle_m - 3.4, middle_m + 0.2):
            wall.box(x_m, 0, 3.2, 3.4, kind.trim)
            wall.box(x_m + 0.2, 0, 2.8, 3.2, kind.door)
        return
    wall.box(middle_m - 0.95, 0, 1.9, 2.7, kind.trim)
    wall.box(middle_m - 0.75, 0, 1.5, 2.5, kind.door)
    if kind.pattern == "cross":
        wall.box(middle_m - 0.3, 3.0, 0.6, 2.0, kind.accent)
        wall.box(middle_m - 1.0, 3.7, 2.0, 0.6, kind.accent)
