"""The second strong colour of a façade: bands, stripes, columns and the like, painted before the
windows. Pure.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cogmap.services.sim.rendering.wall import Wall

# A usual height, as LEVEL_M of osm/buildings.py.
STOREY_M = 3.0


def bands(wall: Wall) -> None:
    """Paint a band above each storey."""
    lowest_m = STOREY_M - 0.35
    bands_m = np.arange(lowest_m, wall.height_m, STOREY_M)
    for z_m in bands_m.tolist():
        wall.box(0, z_m, wall.width_m, 0.8, wall.kind.accent)


def stripes(wall: Wall) -> None:
    """Paint upright stripes, a metre each."""
    end_m = int(wall.width_m) + 1
    for x_m in range(0, end_m, 2):
        wall.box(x_m, 0, 0.9, wall.height_m, wall.kind.accent)


def columns(wall: Wall) -> None:
    """Paint columns under an architrave."""
    accent = wall.kind.accent
    number = max(3, round(wall.width_m / 2.6))
    last_m = wall.width_m - 0.9

    for x_m in np.linspace(0, last_m, number).tolist():
        wall.box(x_m, 0, 0.9, wall.height_m, accent)

    architrave_m = wall.height_m - 1.1
    wall.box(0, architrave_m, wall.width_m, 1.1, accent)


def checker(wall: Wall) -> None:
    """Paint squares of a metre."""
    accent = wall.kind.accent
    width = int(wall.width_m) + 1
    height = int(wall.height_m) + 1

    for x_m in range(width):
        for z_m in range(x_m % 2, height, 2):
            wall.box(x_m, z_m, 1, 1, accent)


def planks(wall: Wall) -> None:
    """Paint level planks."""
    accent = wall.kind.accent
    planks_m = np.arange(0.5, wall.height_m, 1.2)
    for z_m in planks_m.tolist():
        wall.box(0, z_m, wall.width_m, 0.45, accent)


def timber(wall: Wall) -> None:
    """Paint a timber frame with braces on the ground floor."""
    accent = wall.kind.accent
    bays = max(2, round(wall.width_m / 2.5))
    bay_m = wall.width_m / bays

    for x_m in np.arange(0, wall.width_m + 0.1, bay_m).tolist():
        post_top = (x_m, wall.height_m)
        wall.line((x_m, 0), post_top, 0.4, accent)

        brace_foot = (x_m + bay_m, 0.4)
        wall.line((x_m, STOREY_M), brace_foot, 0.3, accent)

    for z_m in np.arange(STOREY_M, wall.height_m, STOREY_M).tolist():
        beam_end = (wall.width_m, z_m)
        wall.line((0, z_m), beam_end, 0.4, accent)


def frame(wall: Wall) -> None:
    """Paint a frame along the top and both edges."""
    accent = wall.kind.accent

    band_m = 0.14 * wall.height_m
    bottom_m = wall.height_m - band_m
    wall.box(0, bottom_m, wall.width_m, band_m, accent)

    right_m = wall.width_m - 0.7
    for x_m in (0, right_m):
        wall.box(x_m, 0.5, 0.7, wall.height_m, accent)


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
