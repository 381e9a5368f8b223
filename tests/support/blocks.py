"""Views of painted blocks on a plane, with true depth: what the recogniser sees, without a
renderer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration

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
        cos = np.cos(self.turn_rad)
        sin = np.sin(self.turn_rad)
        enter = np.full(slope.shape, -np.inf)
        leave = np.full(slope.shape, np.inf)
        for (axis_x, axis_y), side in zip(((cos, sin), (-sin, cos)), self.sides_m, strict=True):
            centre = (self.x_m - CAMERA.mount_forward_m) * axis_x + self.y_m * axis_y
            speed = axis_x - slope * axis_y
            speed = np.where(np.abs(speed) < 1e-12, 1e-12, speed)
            ends = np.sort(
                np.stack([(centre - side / 2) / speed, (centre + side / 2) / speed]), axis=0
            )
            enter = np.maximum(enter, ends[0])
            leave = np.minimum(leave, ends[1])
        return np.where((enter < leave) & (enter > 0), enter, np.inf)


def painted(
    blocks: list[Block], road_half_m: float = 4.0, seed: int = 0
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32], npt.NDArray[np.uint8]]:
    """Image, depth (0 in the sky) and label (1 + block) of `blocks` along a straight road, with a
    little noise.
    """
    rows, columns = np.indices((CAMERA.height_px, CAMERA.width_px))
    down = (rows - CAMERA.cy_px) / CAMERA.fy_px
    slope = (columns - CAMERA.cx_px) / CAMERA.fx_px
    depth = np.where(down > 0, CAMERA.mount_height_m / np.maximum(down, 1e-6), np.inf)
    on_road = np.abs(slope * np.where(down > 0, depth, 1e6)) < road_half_m
    image = np.where((down > 0)[..., None], np.where(on_road[..., None], ASPHALT, GRASS), SKY)
    label = np.zeros(depth.shape, np.uint8)
    for number, block in enumerate(blocks):
        reach = block.depth_m(slope)
        height = CAMERA.mount_height_m - down * reach
        hit = np.isfinite(reach) & (reach < depth) & (height >= 0) & (height <= block.height_m)
        depth[hit], image[hit], label[hit] = reach[hit], block.colour, number + 1
    depth[depth > 150] = 0
    noisy = image + np.random.default_rng(seed).normal(0, 3, image.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8), depth.astype(np.float32), label
