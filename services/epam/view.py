"""A view as arrays, believed only where its parts fit together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cogmap.errors import MessageError
from schemas.sensing import View


@dataclass(frozen=True, eq=False)
class Seen:
    """The image uint8 (h, w, 3), and depth in metres and disparity in pixels, float32 (h, w), 0
    where unknown.
    """

    image: npt.NDArray[np.uint8]
    depth_m: npt.NDArray[np.float32]
    disparity_px: npt.NDArray[np.float32]


def pixels(view: View) -> Seen:
    """The arrays of `view`. Raises MessageError where image, depth and calibration do not fit."""
    camera = view.calibration
    size = (camera.height_px, camera.width_px)
    if (view.image.dtype, view.image.shape) != ("|u1", (*size, 3)):
        raise MessageError(
            f"view: expected a uint8 image {(*size, 3)}, got {view.image.dtype} {view.image.shape}"
        )
    if (view.depth_m.dtype, view.depth_m.shape) != ("<f4", size):
        raise MessageError(
            f"view: expected float32 depth {size}, got {view.depth_m.dtype} {view.depth_m.shape}"
        )
    depth_m = view.depth_m.numpy().astype(np.float32, copy=False)
    if min(camera.fx_px, camera.fy_px) < 1.0:
        raise MessageError("view: its calibration's focal lengths must be at least 1 pixel")
    if (depth_m < 0).any():
        raise MessageError("view: depth is negative")
    focal_baseline = np.float32(camera.fx_px * camera.baseline_m)
    known = depth_m > focal_baseline / camera.width_px
    disparity_px = np.divide(focal_baseline, depth_m, out=np.zeros(size, np.float32), where=known)
    return Seen(view.image.numpy().astype(np.uint8, copy=False), depth_m, disparity_px)
