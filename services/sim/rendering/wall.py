"""A wall to paint on, in metres, and the grain that stereo matching needs. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.services.sim.layout.catalogue import BuildingType, Colour

# As fine as the camera's image of a wall 10 m away.
PX_PER_M = 20
GRAIN = ((1, 0.5), (4, 0.5), (12, 0.45), (40, 0.3))
Image = npt.NDArray[np.uint8]


@dataclass
class Wall:
    """A canvas of `width_m` x `height_m`; x from the left, z up from the ground, both in metres."""

    kind: BuildingType
    width_m: float
    height_m: float

    def __post_init__(self) -> None:
        height_px = _pixels(self.height_m)
        width_px = _pixels(self.width_m)

        shape = (height_px, width_px, 3)
        self.image: Image = np.full(shape, self.kind.wall, np.uint8)

    def box(self, x_m: float, z_m: float, width_m: float, height_m: float, colour: Colour) -> None:
        """Paint a rectangle whose lower left corner is (`x_m`, `z_m`)."""
        left = _pixels(x_m)
        right = left + _pixels(width_m)

        top_m = self.height_m - z_m - height_m
        top = _pixels(top_m)
        bottom = top + _pixels(height_m)

        rows = slice(max(top, 0), max(bottom, 0))
        columns = slice(max(left, 0), max(right, 0))
        self.image[rows, columns] = colour

    def line(
        self, a_m: tuple[float, float], b_m: tuple[float, float], width_m: float, colour: Colour
    ) -> None:
        """Paint a line from `a_m` to `b_m`."""
        start = self._pixel(*a_m)
        end = self._pixel(*b_m)
        cv2.line(self.image, start, end, colour, _pixels(width_m))

    def _pixel(self, x_m: float, z_m: float) -> tuple[int, int]:
        """Return the column and row of a point."""
        return _pixels(x_m), _pixels(self.height_m - z_m)


def _pixels(length_m: float) -> int:
    return round(length_m * PX_PER_M)


def shaded(colour: Colour, factor: float) -> Colour:
    """Make `colour` darker or lighter."""
    levels = [round(factor * level) for level in colour]

    red, green, blue = (min(255, level) for level in levels)
    return red, green, blue


def plain(side_px: int, colour: Colour) -> Image:
    """Make a square picture of one colour."""
    shape = (side_px, side_px, 3)
    return np.full(shape, colour, np.uint8)


def roughen(image: Image, rng: np.random.Generator, strength: float = 0.13) -> Image:
    """Return `image` with grain on it: brightness factors around 1, in four scales, so that stereo
    finds them near and far.
    """
    height_px, width_px, _ = image.shape
    total = np.ones((height_px, width_px), np.float32)
    for scale, share in GRAIN:
        coarse_shape = (height_px // scale + 2, width_px // scale + 2)
        coarse = rng.standard_normal(coarse_shape, np.float32)

        fine = cv2.resize(coarse, (width_px, height_px), interpolation=cv2.INTER_LINEAR)
        total += strength * share * fine

    rough: Image = np.clip(image * total[..., None], 0, 255).astype(np.uint8)
    return rough
