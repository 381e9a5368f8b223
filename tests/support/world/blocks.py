"""Views of painted blocks on a plane, with true depth: what the recogniser sees, without a
renderer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cogmap.schemas.sensing import Calibration

CAMERA = Calibration(
    width_px=320,
    height_px=240,
    fx_px=208.0,
    fy_px=208.0,
    cx_px=159.5,
    cy_px=119.5,
    baseline_m=0.5,
    mount_height_m=1.5,
    mount_forward_m=0.3,
)
SKY = (120, 170, 226)
GRASS = (104, 138, 66)
ASPHALT = (88, 88, 94)
MIN_SPEED = 1e-12
MAX_DEPTH_M = 150
NOISE_SD = 3
Colour = tuple[int, int, int]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """A block: centre in the robot's frame (x forward, y left), turn, sides, height and colour."""

    x_m: float
    y_m: float
    turn_rad: float
    sides_m: tuple[float, float]
    height_m: float
    colour: Colour

    def depth_m(self, slope: Floats) -> Floats:
        """Depth at which the level ray `slope` (right over forward) enters it, infinite where it
        passes by.
        """
        cos = float(np.cos(self.turn_rad))
        sin = float(np.sin(self.turn_rad))
        length_m, width_m = self.sides_m
        first = self._between(slope, (cos, sin), length_m)
        second = self._between(slope, (-sin, cos), width_m)

        enter = np.maximum(first[0], second[0])
        leave = np.minimum(first[1], second[1])
        hits = (enter < leave) & (enter > 0)
        return np.where(hits, enter, np.inf)

    def _between(self, slope: Floats, axis: tuple[float, float], side_m: float) -> Floats:
        """(2, ...): depths at which the ray enters and leaves the slab between two sides."""
        axis_x, axis_y = axis
        forward_m = self.x_m - CAMERA.mount_forward_m
        centre_m = forward_m * axis_x + self.y_m * axis_y
        speed = axis_x - slope * axis_y
        speed = np.where(np.abs(speed) < MIN_SPEED, MIN_SPEED, speed)

        near = (centre_m - side_m / 2) / speed
        far = (centre_m + side_m / 2) / speed
        return np.sort(np.stack([near, far]), axis=0)


def painted(
    blocks: list[Block], road_half_m: float = 4.0, seed: int = 0
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32], npt.NDArray[np.uint8]]:
    """Image, depth (0 in the sky) and label (1 + block) of `blocks` along a straight road, with a
    little noise.
    """
    rows, columns = np.indices((CAMERA.height_px, CAMERA.width_px))
    down = (rows - CAMERA.cy_px) / CAMERA.fy_px
    slope = (columns - CAMERA.cx_px) / CAMERA.fx_px
    image, depth = _ground(down, slope, road_half_m)
    label = np.zeros(depth.shape, np.uint8)

    for number, block in enumerate(blocks, 1):
        reach = block.depth_m(slope)
        height = CAMERA.mount_height_m - down * reach
        is_nearer = np.isfinite(reach) & (reach < depth)
        hit = is_nearer & (height >= 0) & (height <= block.height_m)
        depth[hit] = reach[hit]
        image[hit] = block.colour
        label[hit] = number

    depth[depth > MAX_DEPTH_M] = 0
    noise = np.random.default_rng(seed).normal(0, NOISE_SD, image.shape)
    noisy = np.clip(image + noise, 0, 255).astype(np.uint8)
    return noisy, depth.astype(np.float32), label


def _ground(
    down: Floats, slope: Floats, road_half_m: float
) -> tuple[npt.NDArray[np.int64], Floats]:
    """Image and depth of a road in grass under the sky; the depth of the sky is infinite."""
    is_ground = down > 0
    depth = np.where(is_ground, CAMERA.mount_height_m / np.maximum(down, 1e-6), np.inf)
    side_m = np.abs(slope * np.where(is_ground, depth, 1e6))
    is_road = side_m < road_half_m

    surface = np.where(is_road[..., None], ASPHALT, GRASS)
    image = np.where(is_ground[..., None], surface, SKY)
    return image, depth
