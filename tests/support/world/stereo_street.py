"""A street of textured planes that a stereo camera drives along: ground, two sides, an end."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Calibration, StereoFrame

Image = npt.NDArray[np.uint8]
Pose = tuple[float, float, float]

CAMERA = Calibration(
    width_px=320,
    height_px=120,
    fx_px=200.0,
    fy_px=200.0,
    cx_px=159.5,
    cy_px=59.5,
    baseline_m=0.5,
    mount_height_m=1.5,
)
LEFT_M = 5.0
RIGHT_M = -6.0
END_M = 45.0
PX_PER_M = 16
NOISE_SD = 1.0


def pair(pose: Pose, camera: Calibration = CAMERA, scale: float = 1.0) -> tuple[Image, Image]:
    """The grey images of a robot at (x forward, y left, heading), in a street `scale` times as
    large.
    """
    return _image(pose, 0.0, camera, scale), _image(pose, camera.baseline_m, camera, scale)


def frame(
    number: int, stamp_ns: int, images: tuple[Image, Image], camera: Calibration = CAMERA
) -> StereoFrame:
    """The message with a pair."""
    left, right = images
    return StereoFrame(
        frame=number,
        stamp_ns=stamp_ns,
        left=Array.of(left),
        right=Array.of(right),
        calibration=camera,
    )


def _image(pose: Pose, right_m: float, camera: Calibration, scale: float) -> Image:
    x_m, y_m, heading_rad = pose
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    forward_m = camera.mount_forward_m
    eye_x_m = x_m + forward_m * cos + right_m * sin
    eye_y_m = y_m + forward_m * sin - right_m * cos

    column, row = np.meshgrid(np.arange(camera.width_px), np.arange(camera.height_px))
    left = -(column - camera.cx_px) / camera.fx_px
    down = (row - camera.cy_px) / camera.fy_px
    ray_x = cos - left * sin
    ray_y = sin + left * cos

    with np.errstate(divide="ignore"):
        planes = [
            camera.mount_height_m * scale / down,
            (LEFT_M * scale - eye_y_m) / ray_y,
            (RIGHT_M * scale - eye_y_m) / ray_y,
            (END_M * scale - eye_x_m) / ray_x,
        ]
    distances = np.stack([np.where(each > 0, each, np.inf) for each in planes])
    nearest = distances.argmin(axis=0)
    distance = distances.min(axis=0)

    across_m = eye_x_m + distance * ray_x
    along_m = eye_y_m + distance * ray_y
    up_m = distance * down
    u_m = np.choose(nearest, [across_m, across_m, across_m, along_m])
    v_m = np.choose(nearest, [along_m, up_m, up_m, up_m])
    texture = _texture()
    size_px = texture.shape[0]
    u_px = ((u_m / scale + 17 * nearest) * PX_PER_M) % (size_px - 1)
    v_px = ((v_m / scale + 31 * nearest) * PX_PER_M) % (size_px - 1)
    grey = cv2.remap(texture, u_px.astype(np.float32), v_px.astype(np.float32), cv2.INTER_LINEAR)
    noise = np.random.default_rng(round(1e3 * abs(x_m + right_m))).normal(0, NOISE_SD, grey.shape)
    return np.clip(grey + noise, 2, 250).astype(np.uint8)


@lru_cache(maxsize=1)
def _texture() -> npt.NDArray[np.float32]:
    rng = np.random.default_rng(7)
    total = np.full((1600, 1600), 120, np.float32)
    for cells in (50, 150, 400):
        coarse = rng.standard_normal((cells, cells)).astype(np.float32)
        total += 22 * cv2.resize(coarse, (1600, 1600), interpolation=cv2.INTER_CUBIC)
    return total
