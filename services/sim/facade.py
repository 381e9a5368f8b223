"""Façades: a picture for each side of a building, drawn from its type. Pure, and the same for every town."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from services.sim.catalogue import BuildingType, Colour

PX_PER_M = 20
STOREY_M = 3.0
Image = npt.NDArray[np.uint8]
_GLASS: Colour = (58, 74, 96)


@dataclass
class _Wall:
    """A canvas of `width_m` x `height_m`; x from the left, z up from the ground, both in metres."""

    image: Image
    height_m: float

    def box(self, x_m: float, z_m: float, width_m: float, height_m: float, colour: Colour) -> None:
        top = round((self.height_m - z_m - height_m) * PX_PER_M)
        left, wide, high = round(x_m * PX_PER_M), round(width_m * PX_PER_M), round(height_m * PX_PER_M)
        self.image[max(top, 0) : max(top + high, 0), max(left, 0) : max(left + wide, 0)] = colour

    def line(self, a: tuple[float, float], b: tuple[float, float], width_m: float, colour: Colour) -> None:
        ends = [(round(x * PX_PER_M), round((self.height_m - z) * PX_PER_M)) for x, z in (a, b)]
        cv2.line(self.image, ends[0], ends[1], colour, round(width_m * PX_PER_M))


def grain(rng: np.random.Generator, height_px: int, width_px: int, strength: float) -> npt.NDArray[np.float32]:
    """Brightness factors around 1, float32 (height, width), in four scales: stereo finds them near and far."""
    total = np.ones((height_px, width_px), np.float32)
    for scale, share in ((1, 0.5), (4, 0.5), (12, 0.45), (40, 0.3)):
        coarse = rng.standard_normal((height_px // scale + 2, width_px // scale + 2)).astype(np.float32)
        fine = cv2.resize(coarse, (width_px, height_px), interpolation=cv2.INTER_LINEAR)
        total += strength * share * np.asarray(fine, np.float32)
    return total


def roughen(image: Image, rng: np.random.Generator, strength: float = 0.13) -> Image:
    """`image` with grain on it."""
    rough = image * grain(rng, image.shape[0], image.shape[1], strength)[..., None]
    return np.clip(rough, 0, 255).astype(np.uint8)


def side(kind: BuildingType, width_m: float, height_m: float, front: bool, number: int) -> Image:
    """Wall `number` of a building, uint8 (height, width, 3): a façade with the door where it is the `front`."""
    rng = np.random.default_rng([zlib.crc32(kind.name.encode()), number])
    wall = _Wall(np.empty((round(height_m * PX_PER_M), round(width_m * PX_PER_M), 3), np.uint8), height_m)
    wall.image[:] = kind.wall
    _pattern(wall, kind, width_m, height_m)
    _windows(wall, kind, width_m, height_m, front, rng)
    if front:
        _door(wall, kind, width_m)
    wall.box(0, 0, width_m, 0.5, tuple(int(0.55 * c) for c in kind.wall))  # type: ignore[arg-type]
    return roughen(wall.image, rng)


def _pattern(wall: _Wall, kind: BuildingType, width_m: float, height_m: float) -> None:
    steps = range(int(width_m) + 1)
    if kind.pattern == "bands":
        for z_m in np.arange(STOREY_M - 0.35, height_m, STOREY_M):
            wall.box(0, float(z_m), width_m, 0.8, kind.accent)
    elif kind.pattern == "stripes":
        for x in steps[::2]:
            wall.box(x, 0, 0.9, height_m, kind.accent)
    elif kind.pattern == "columns":
        for x_m in np.linspace(0, width_m - 0.9, max(3, round(width_m / 2.6))):
            wall.box(float(x_m), 0, 0.9, height_m, kind.accent)
        wall.box(0, height_m - 1.1, width_m, 1.1, kind.accent)
    elif kind.pattern == "checker":
        for x in steps:
            for z in range(x % 2, int(height_m) + 1, 2):
                wall.box(x, z, 1, 1, kind.accent)
    elif kind.pattern == "planks":
        for z_m in np.arange(0.5, height_m, 1.2):
            wall.box(0, float(z_m), width_m, 0.45, kind.accent)
    elif kind.pattern == "timber":
        _timber(wall, kind, width_m, height_m)
    elif kind.pattern in ("cross", "gates", "grid"):
        band_m = 0.14 * height_m
        wall.box(0, height_m - band_m, width_m, band_m, kind.accent)
        wall.box(0, 0.5, 0.7, height_m, kind.accent)
        wall.box(width_m - 0.7, 0.5, 0.7, height_m, kind.accent)


def _timber(wall: _Wall, kind: BuildingType, width_m: float, height_m: float) -> None:
    bay_m = width_m / max(2, round(width_m / 2.5))
    for x_m in np.arange(0, width_m + 0.1, bay_m):
        x = float(x_m)
        wall.line((x, 0), (x, height_m), 0.4, kind.accent)
        wall.line((x, STOREY_M), (x + bay_m, 0.4), 0.3, kind.accent)
    for z_m in np.arange(STOREY_M, height_m, STOREY_M):
        wall.line((0, float(z_m)), (width_m, float(z_m)), 0.4, kind.accent)


def _windows(wall: _Wall, kind: BuildingType, width_m: float, height_m: float, front: bool, rng: np.random.Generator) -> None:
    columns = max(2, int(width_m / 2.6))
    pitch_m = width_m / columns
    for storey in range(max(1, int((height_m - 0.6) / STOREY_M))):
        for column in range(columns):
            middle_m = (column + 0.5) * pitch_m
            if front and storey == 0 and abs(middle_m - width_m / 2) < 1.7:
                continue
            _window(wall, kind, middle_m, storey * STOREY_M + 1.0, rng)


def _window(wall: _Wall, kind: BuildingType, middle_m: float, sill_m: float, rng: np.random.Generator) -> None:
    wall.box(middle_m - 0.6, sill_m - 0.1, 1.2, 1.6, kind.trim)
    shade = float(rng.uniform(0.7, 1.5))
    wall.box(middle_m - 0.48, sill_m, 0.96, 1.4, tuple(min(255, int(shade * c)) for c in _GLASS))  # type: ignore[arg-type]
    wall.box(middle_m - 0.05, sill_m, 0.1, 1.4, kind.trim)
    wall.box(middle_m - 0.48, sill_m + 0.85, 0.96, 0.1, kind.trim)
    if kind.pattern == "shutters":
        for x_m in (middle_m - 1.2, middle_m + 0.6):
            wall.box(x_m, sill_m - 0.1, 0.6, 1.6, kind.accent)


def _door(wall: _Wall, kind: BuildingType, width_m: float) -> None:
    middle_m = width_m / 2
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
