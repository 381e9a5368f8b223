"""The second strong colour of a façade: bands, stripes, columns and the like, painted before the
windows. Pure.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from services.sim.rendering.wall import Wall

STOREY_M = 3.0


def bands(wall: Wall) -> None:
    """A band above each storey."""
    for z_m in np.arange(STOREY_M - 0.35, wall.height_m, STOREY_M).tolist():
        wall.box(0, z_m, wall.width_m, 0.8, wall.kind.accent)


def stripes(wall: Wall) -> None:
    """Upright stripes, a metre each."""
    for x in range(0, int(wall.width_m) + 1, 2):
        wall.box(x, 0, 0.9, wall.height_m, wall.kind.accent)


def columns(wall: Wall) -> None:
    """Columns under an architrave."""
    for x_m in np.linspace(0, wall.width_m - 0.9, max(3, round(wall.width_m / 2.6))).tolist():
        wall.box(x_m, 0, 0.9, wall.height_m, wall.kind.accent)
    wall.box(0, wall.height_m - 1.1, wall.width_m, 1.1, wall.kind.accent)


def checker(wall: Wall) -> None:
    """Squares of a metre."""
    for x in range(int(wall.width_m) + 1):
        for z in range(x % 2, int(wall.height_m) + 1, 2):
            wall.box(x, z, 1, 1, wall.kind.accent)


def planks(wall: Wall) -> None:
    """Level planks."""
    for z_m in np.arange(0.5, wall.height_m, 1.2).tolist():
        wall.box(0, z_m, wall.width_m, 0.45, wall.kind.accent)


def timber(wall: Wall) -> None:
    """A timber frame with braces on the ground floor."""
    bay_m = wall.width_m / max(2, round(wall.width_m / 2.5))
    accent = wall.kind.accent
    for x in np.arange(0, wall.width_m + 0.1, bay_m).tolist():
        wall.line((x, 0), (x, wall.height_m), 0.4, accent)
        wall.line((x, STOREY_M), (x + bay_m, 0.4), 0.3, accent)
    for z in np.arange(STOREY_M, wall.height_m, STOREY_M).tolist():
        wall.line((0, z), (wall.width_m, z), 0.4, accent)


def frame(wall: Wall) -> None:
    """A frame along the top and both edges."""
    band_m = 0.14 * wall.height_m
    wall.box(0, wall.height_m - band_m, wall.width_m, band_m, wall.kind.accent)
    for x_m in (0, wall.width_m - 0.7):
        wall.box(x_m, 0.5, 0.7, wall.height_m, wall.kind.accent)


PAINT: dict[str, Callable[[Wall], None]] = {
    "bands": bands,
    "stripes": stripes,
    "columns": columns,
    "checker": checker,
    "planks": planks,
    "timber": timber,
    "cross": frame,
    "gates": frame,
    "grid": frame,
}
