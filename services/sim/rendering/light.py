"""Time of day and weather, and how a camera exposes them: shadows, colour, blur and noise. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from cogmap.geometry.arrays import Floats, Singles
from cogmap.services.sim.layout.plan import Rectangle
from cogmap.services.sim.rendering.wall import Image

Box = tuple[Rectangle, float]

# The relief is a square of 200 m around the middle: a town of one loop is smaller.
_CELL_M = 0.5
_CELLS = 400
# So far before a surface its shadow is looked up: more than a cell.
_CLEAR_M = 0.6
_PENUMBRA_PX = (5, 5)


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
        """Return the unit vector to the sun: east, north, up."""
        flat = math.cos(self.sun_elevation_rad)

        east = flat * math.cos(self.sun_azimuth_rad)
        north = flat * math.sin(self.sun_azimuth_rad)
        up = math.sin(self.sun_elevation_rad)

        return east, north, up


def some_light(rng: np.random.Generator) -> Light:
    """Draw the light of any hour of a day with the sun up, in any weather but fog."""
    elevation_rad = float(rng.uniform(0.25, 1.2))
    low_sun = 1.2 - elevation_rad
    warmth = float(rng.uniform(-0.06, 0.1) + 0.06 * low_sun)
    tint = float(rng.uniform(-0.03, 0.03))
    azimuth_rad = float(rng.uniform(-math.pi, math.pi))

    is_clouded = rng.random() < 0.3
    shade = 1.0 if is_clouded else float(rng.uniform(0.5, 0.85))
    gain = float(rng.uniform(0.65, 1.2))
    gamma = float(rng.uniform(0.8, 1.25))
    is_sharp = rng.random() < 0.5
    blur_px = 0.0 if is_sharp else float(rng.uniform(0.3, 0.9))

    return Light(
        sun_azimuth_rad=azimuth_rad,
        sun_elevation_rad=elevation_rad,
        shade=shade,
        cast=(1 + warmth, 1 + tint, 1 - warmth),
        gain=gain,
        gamma=gamma,
        blur_px=blur_px,
        noise=float(rng.uniform(0.5, 5.0)),
    )


def relief(boxes: list[Box]) -> Singles:
    """Compute the height of the town in each cell of _CELL_M, float32 (n, n), rows from south to
    north, columns from west to east.
    """
    shape = (_CELLS, _CELLS)
    heights_m = np.zeros(shape, np.float32)

    for area, height_m in boxes:
        sides = [max(_CELLS // 2 + round(side_m / _CELL_M), 0) for side_m in area]
        west, south, east, north = sides
        cells = heights_m[south:north, west:east]

        np.maximum(cells, height_m, out=cells)

    return heights_m


def shadow_top(heights_m: Singles, light: Light) -> Singles:
    """Compute the height up to which each cell of a relief lies in the shadow of others, in metres,
    float32 like `heights_m`.
    """
    east, north, up = light.sun
    flat = math.hypot(east, north)

    highest_m = float(heights_m.max())
    longest_m = highest_m * flat / up
    steps = math.ceil(longest_m / _CELL_M)

    top_m = np.zeros_like(heights_m)
    for step in range(1, steps + 1):
        dx = round(step * east / flat)
        dy = round(step * north / flat)
        drop_m = np.float32(step * _CELL_M * up / flat)

        # A cell is in the shadow of the one that is dx and dy further on.
        shaded_rows, casting_rows = _shifted(dy)
        shaded_columns, casting_columns = _shifted(dx)
        shaded = top_m[shaded_rows, shaded_columns]
        casting = heights_m[casting_rows, casting_columns] - drop_m
        np.maximum(shaded, casting, out=shaded)

    return top_m


def _shifted(cells: int) -> tuple[slice, slice]:
    """Return the cells that have another one `cells` further on, and these others."""
    ahead = max(0, cells)
    back = max(0, -cells)
    return slice(back, _CELLS - ahead), slice(ahead, _CELLS - back)


def brightness(
    depth_m: Singles, rays: Singles, at: Floats, top_m: Singles, light: Light
) -> Singles:
    """Compute the brightness of each pixel under `light`, float32 (h, w) from `shade` to 1.

    `depth_m` (h, w) is 0 in the sky; `rays` (h, w, 3) are the directions of the pixels in the
    world, of length 1 along the optical axis, from `at`; `top_m` is the result of `shadow_top`.
    """
    # A little nearer than the surface, which would shade itself.
    reach_m = (depth_m - _CLEAR_M)[..., None]
    points_m = at.astype(np.float32) + rays * reach_m

    cells = points_m[..., :2] / _CELL_M + _CELLS / 2
    column, row = np.moveaxis(cells.clip(0, _CELLS - 1).astype(np.int64), 2, 0)
    is_shaded = (points_m[..., 2] < top_m[row, column]) & (depth_m > 0)
    share = np.where(is_shaded, light.shade, 1.0).astype(np.float32)
    softened = cv2.blur(share, _PENUMBRA_PX)
    return np.asarray(softened, np.float32)


def expose(image: Image, bright: Singles, light: Light, rng: np.random.Generator) -> Image:
    """Expose `image` (h, w, 3) as the camera does; `bright` (h, w) is how much light is left."""
    cast = np.asarray(light.cast, np.float32)
    surface = image.astype(np.float32) / 255
    lit = surface * bright[..., None]
    linear = np.clip(lit * cast * light.gain, 0.0, 1.0)
    exposed = np.asarray(linear ** np.float32(light.gamma), np.float32)
    if light.blur_px:
        blurred = cv2.GaussianBlur(exposed, (0, 0), light.blur_px)
        exposed = np.asarray(blurred, np.float32)

    noise = rng.standard_normal(exposed.shape, np.float32)
    brighter_is_noisier = np.sqrt(0.3 + exposed)
    levels = 255 * exposed + light.noise * (noise * brighter_is_noisier)

    rounded: Image = np.clip(levels + 0.5, 0, 255).astype(np.uint8)
    return rounded
