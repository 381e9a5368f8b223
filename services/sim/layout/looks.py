"""What a building looks like of which nothing is known but its name. Pure."""

from __future__ import annotations

import colorsys
import zlib

import numpy as np

from cogmap.services.sim.layout.catalogue import BuildingType, Colour

_TRIM: Colour = (240, 238, 232)
_ROOF: Colour = (110, 100, 96)
_PATTERNS = ("", "bands", "stripes", "columns", "grid", "timber")


def drawn_from_name(name: str, size_m: tuple[float, float, float]) -> BuildingType:
    """Draw the looks of a building of that width, depth and height: of one name always alike."""
    width_m, depth_m, height_m = size_m
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    hue = float(rng.random())

    return BuildingType(
        name=name,
        width_m=width_m,
        depth_m=depth_m,
        height_m=height_m,
        wall=_paint(hue, 0.35, 0.85),
        accent=_paint((hue + 0.4) % 1.0, 0.5, 0.45),
        trim=_TRIM,
        door=_paint((hue + 0.7) % 1.0, 0.5, 0.4),
        roof=_ROOF,
        pattern=str(rng.choice(_PATTERNS)),
    )


def _paint(hue: float, saturation: float, value: float) -> Colour:
    red, green, blue = (round(255 * share) for share in colorsys.hsv_to_rgb(hue, saturation, value))
    return red, green, blue
