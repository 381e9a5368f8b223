"""The hour and the weather, and how the camera takes them: shadows, colour, exposure, blur and
noise. Pure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from services.sim.layout.plan import Rectangle
from services.sim.rendering.wall import Image

Matrix = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]
Box = tuple[Rectangle, float]

_CELL_M = 0.5
_CELLS = 400
_CLEAR_M = 0.6


@dataclass(frozen=True)
class Light:
    """The sun stands at `sun_azimuth_rad` (counter-clockwise from east) and `sun_elevation_rad`.

    `shade` is the brightness left in a shadow, 1 under a clouded sky; `cast` multiplies red, green
    and blue. The camera multiplies by `gain`, raises to the power `gamma`, blurs by `blur_px` and
    adds noise of SD `noise`, in levels of 255, which grows with brightness.
    """

    sun_azimuth_rad: float
    sun_elevation_rad: float
    shade: float = 1.0
    cast: tuple[float, float, float] = (1.0, 1.0, 1.0)
    gain: float = 1.0
    gamma: float = 1.0
    blur_px: float = 0.0
    noise: float = 0.0

    @property
    def sun(self) -> tuple[float, float, float]:
        """The direction to the sun: east, north, up."""
        flat = math.cos(self.sun_elevation_rad)
        x = flat * math.cos(self.sun_azimuth_rad)
        y = flat * math.sin(self.sun_azimuth_rad)
        return x, y, math.sin(self.sun_elevation_rad)


def some_light(rng: np.random.Generator) -> Light:
    """Any hour of a day with the sun up, any weather but night and fog."""
    elevation_rad = float(rng.uniform(0.25, 1.2))
    warmth = float(rng.uniform(-0.06, 0.1) + 0.06 * (1.2 - elevation_rad))
    tint = float(rng.uniform(-0.03, 0.03))
    return Light(
        sun_azimuth_rad=float(rng.uniform(-math.pi, math.pi)),
        sun_elevation_rad=elevation_rad,
        shade=1.0 if rng.random() < 0.3 else float(rng.uniform(0.5, 0.85)),
        cast=(1 + warmth, 1 + tint, 1 - warmth),
        gain=float(rng.uniform(0.65, 1.2)),
        gamma=float(rng.uniform(0.8, 1.25)),
        blur_px=0.0 if rng.random() < 0.5 else float(rng.uniform(0.3, 0.9)),
        noise=float(rng.uniform(0.5, 5.0)),
    )


def relief(boxes: list[Box]) -> Floats:
    """How high the town stands in each cell of _CELL_M, float32 (n, n), rows from south to north,
    columns from west.
    """
    heights = np.zeros((_CELLS, _CELLS), np.float32)
    for area, height_m in boxes:
        west, south, east, north = (round(side / _CELL_M) + _CELLS // 2 for side in area)
        cells = heights[max(south, 0) : max(north, 0), max(west, 0) : max(east, 0)]
        np.maximum(cells, height_m, out=cells)
    return heights


def shadow_top(heights: Floats, light: Light) -> Floats:
    """Up to which height each cell of a relief lies in the shadow of others, metres, float32 like
    `heights`.
    """
    east, north, up = light.sun
    top = np.zeros_like(heights)
    steps = math.ceil(float(heights.max()) * math.hypot(east, north) / up / _CELL_M)
    for step in range(1, steps + 1):
        dx, dy = (round(step * side / math.hypot(east, north)) for side in (east, north))
        here = (slice(max(0, -dy), _CELLS - max(0, dy)), slice(max(0, -dx), _CELLS - max(0, dx)))
        there = (slice(max(0, dy), _CELLS + min(0, dy)), slice(max(0, dx), _CELLS + min(0, dx)))
        drop_m = step * _CELL_M * up / math.hypot(east, north)
        np.maximum(top[here], heights[there] - np.float32(drop_m), out=top[here])
    return top


def brightness(depth_m: Floats, rays: Floats, at: Matrix, top_m: Floats, light: Light) -> Floats:
    """How bright each pixel is under `light`, float32 (h, w) from `shade` to 1.

    `depth_m` (h, w), 0 in the sky; `rays` (h, w, 3) are the directions of the pixels in the world,
    of length 1 along the optical axis, from `at`; `top_m` is what `shadow_top` gives.
    """
    points = at.astype(np.float32) + rays * (depth_m - _CLEAR_M)[..., None]
    column, row = (
        np.clip(points[..., axis] / _CELL_M + _CELLS / 2, 0, _CELLS - 1).astype(np.intp)
        for axis in (0, 1)
    )
    dark = (points[..., 2] < top_m[row, column]) & (depth_m > 0)
    return np.asarray(
        cv2.blur(np.where(dark, light.shade, 1.0).astype(np.float32), (5, 5)), np.float32
    )


def taken(image: Image, bright: Floats, light: Light, rng: np.random.Generator) -> Image:
    """`image` (h, w, 3) as the camera takes it, where `bright` (h, w) is left of the light."""
    seen = (
        image.astype(np.float32)
        / 255
        * bright[..., None]
        * np.asarray(light.cast, np.float32)
        * light.gain
    )
    seen = np.clip(seen, 0.0, 1.0) ** np.float32(light.gamma)
    if light.blur_px:
        seen = np.asarray(cv2.GaussianBlur(seen, (0, 0), light.blur_px), np.float32)
    noise = rng.standard_normal(seen.shape, np.float32) * np.sqrt(0.3 + seen)
    return np.clip(255 * seen + light.noise * noise + 0.5, 0, 255).astype(np.uint8)
