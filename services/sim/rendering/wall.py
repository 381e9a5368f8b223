"""A wall to paint on, in metres, and the grain that stereo matching needs. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from services.sim.layout.catalogue import BuildingType, Colour

PX_PER_M = 20
Image = npt.NDArray[np.uint8]


@dataclass
class Wall:
    """A canvas of `width_m` x `height_m`; x from the left, z up from the ground, both in metres."""

    kind: BuildingType
    width_m: float
    height_m: float

    def __post_init__(self) -> None:
        shape = (round(self.height_m * PX_PER_M), round(self.width_m * PX_PER_M), 3)
        self.image: Image = np.full(shape, self.kind.wall, np.uint8)

    def box(self, x_m: float, z_m: float, width_m: float, height_m: float, colour: Colour) -> None:
        """Paint a rectangle whose lower left corner is (`x_m`, `z_m`)."""
        left = round(x_m * PX_PER_M)
        top = round((self.height_m - z_m - height_m) * PX_PER_M)
        right = left + round(width_m * PX_PER_M)
        bottom = top + round(height_m * PX_PER_M)
        self.image[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)] = colour

    def line(
        self, a_m: tuple[float, float], b_m: tuple[float, float], width_m: float, colour: Colour
    ) -> None:
        """Paint a line from `a_m` to `b_m`."""
        ends = [(round(x * PX_PER_M), round((self.height_m - z) * PX_PER_M)) for x, z in (a_m, b_m)]
        cv2.line(self.image, ends[0], ends[1], colour, round(width_m * PX_PER_M))


def shaded(colour: Colour, factor: float) -> Colour:
    """`colour`, darker or lighter."""
    red, green, blue = (min(255, round(factor * c)) for c in colour)
    return red, green, blue


def plain(side_px: int, colour: Colour) -> Image:
    """A square picture of one colour."""
    return np.full((side_px, side_px, 3), colour, np.uint8)


def roughen(image: Image, rng: np.random.Generator, strength: float = 0.13) -> Image:
    """`image` with grain on it."""
    tall, wide = image.shape[:2]
    rough: Image = np.clip(image * _grain(rng, tall, wide, strength)[..., None], 0, 255).astype(
        np.uint8
    )
    return rough


def _grain(
    rng: np.random.Generator, tall_px: int, wide_px: int, strength: float
) -> npt.NDArray[np.float32]:
    """Brightness factors around 1, in four scales: stereo finds them near and far."""
    total = np.ones((tall_px, wide_px), np.float32)
    for scale, share in ((1, 0.5), (4, 0.5), (12, 0.45), (40, 0.3)):
        coarse = rng.standard_normal((tall_px // scale + 2, wide_px // scale + 2), np.float32)
        total += (
            strength
            * share
            * cv2.resize(coarse, (wide_px, tall_px), interpolation=cv2.INTER_LINEAR)
        )
    return total
