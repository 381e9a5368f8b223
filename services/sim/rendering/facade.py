"""Façades: a picture for each side of a building, drawn from its type. Pure, and the same in every
town.
"""

from __future__ import annotations

import zlib

import numpy as np

from cogmap.services.sim.layout.catalogue import BuildingType, Colour
from cogmap.services.sim.rendering.patterns import PAINT, STOREY_M
from cogmap.services.sim.rendering.wall import PX_PER_M, Image, Wall, roughen, shaded

_GLASS: Colour = (58, 74, 96)
# Looks alone, but EPAM's networks were trained on buildings that look so.
_PLINTH_M = 0.5
_BAY_M = 2.6
_SILL_M = 1.0
_HALF_ENTRANCE_M = 1.7
_ROOF_PICTURE = 4


def side(kind: BuildingType, width_m: float, number: int) -> Image:
    """Draw wall `number` of a building, uint8 (height, width, 3). Number 0 is the front and has the
    door.
    """
    rng = _generator(kind, number)
    wall = Wall(kind, width_m, kind.height_m)
    is_front = number == 0

    if kind.pattern in PAINT:
        PAINT[kind.pattern](wall)

    storeys = max(1, int((wall.height_m - 0.6) / STOREY_M))
    columns = max(2, int(width_m / _BAY_M))
    for storey in range(storeys):
        for column in range(columns):
            middle_m = (column + 0.5) * width_m / columns
            is_over_door = abs(middle_m - width_m / 2) < _HALF_ENTRANCE_M
            if not (is_front and storey == 0 and is_over_door):
                shade = float(rng.uniform(0.7, 1.5))
                _add_window(wall, middle_m, storey * STOREY_M + _SILL_M, shade)

    if is_front:
        _add_entrance(wall)

    wall.box(0, 0, width_m, _PLINTH_M, shaded(kind.wall, 0.55))

    return roughen(wall.image, rng)


def roof(kind: BuildingType) -> Image:
    """Draw the roof from above, uint8 (depth, width, 3), in courses."""
    depth_px = round(kind.depth_m * PX_PER_M)
    width_px = round(kind.width_m * PX_PER_M)

    picture = np.full((depth_px, width_px, 3), kind.roof, np.uint8)

    course_px = PX_PER_M // 2
    picture[::course_px] = shaded(kind.roof, 0.75)

    return roughen(picture, _generator(kind, _ROOF_PICTURE))


def _generator(kind: BuildingType, number: int) -> np.random.Generator:
    """Make a source of random numbers for one picture of a type."""
    name = kind.name.encode()
    return np.random.default_rng([zlib.crc32(name), number])


def _add_window(wall: Wall, middle_m: float, sill_m: float, shade: float) -> None:
    trim = wall.kind.trim
    bottom_m = sill_m - 0.1
    wall.box(middle_m - 0.6, bottom_m, 1.2, 1.6, trim)

    left_m = middle_m - 0.48
    wall.box(left_m, sill_m, 0.96, 1.4, shaded(_GLASS, shade))
    wall.box(middle_m - 0.05, sill_m, 0.1, 1.4, trim)
    wall.box(left_m, sill_m + 0.85, 0.96, 0.1, trim)

    if wall.kind.pattern == "shutters":
        wall.box(middle_m - 1.2, bottom_m, 0.6, 1.6, wall.kind.accent)
        wall.box(middle_m + 0.6, bottom_m, 0.6, 1.6, wall.kind.accent)


def _add_entrance(wall: Wall) -> None:
    """Add two gates, or a door, over which a pharmacy has a cross."""
    kind = wall.kind
    middle_m = wall.width_m / 2
    if kind.pattern == "gates":
        for left_m in (middle_m - 3.4, middle_m + 0.2):
            wall.box(left_m, 0, 3.2, 3.4, kind.trim)
            wall.box(left_m + 0.2, 0, 2.8, 3.2, kind.door)
        return

    wall.box(middle_m - 0.95, 0, 1.9, 2.7, kind.trim)
    wall.box(middle_m - 0.75, 0, 1.5, 2.5, kind.door)
    if kind.pattern == "cross":
        wall.box(middle_m - 0.3, 3.0, 0.6, 2.0, kind.accent)
        wall.box(middle_m - 1.0, 3.7, 2.0, 0.6, kind.accent)
