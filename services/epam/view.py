"""Reads the arrays of a view, after checks that they fit each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Bytes, Singles
from cogmap.schemas.sensing import View

# With a shorter one a calibration is refused: it is no camera's.
MIN_FOCAL_LENGTH_PX = 1.0


@dataclass(frozen=True, eq=False)
class ViewArrays:
    """RGB `image`, uint8 (h, w, 3), with its depth in metres and its disparity in pixels, float32
    (h, w), 0 if unknown.
    """

    image: Bytes
    depth_m: Singles
    disparity_px: Singles


def view_arrays(view: View) -> ViewArrays:
    """Return the arrays of `view`. Raises MessageError if image, depth and calibration do not fit
    each other.
    """
    camera = view.calibration
    size = (camera.height_px, camera.width_px)
    for name, array, dtype, shape in (
        ("uint8 image", view.image, "|u1", (*size, 3)),
        ("float32 depth", view.depth_m, "<f4", size),
    ):
        if (array.dtype, array.shape) != (dtype, shape):
            raise MessageError(f"view: expected {name} {shape}, got {array.dtype} {array.shape}")

    depth_m = view.depth_m.numpy().astype(np.float32, copy=False)
    if min(camera.fx_px, camera.fy_px) < MIN_FOCAL_LENGTH_PX:
        raise MessageError("view: its calibration's focal lengths must be at least 1 pixel")
    if (depth_m < 0).any():
        raise MessageError("view: depth is negative")

    # Disparities beyond the image's width cannot be matched and count as unknown.
    focal_baseline = np.float32(camera.fx_px * camera.baseline_m)
    known = depth_m > focal_baseline / camera.width_px
    disparity_px = np.zeros(depth_m.shape, np.float32)
    np.divide(focal_baseline, depth_m, out=disparity_px, where=known)
    return ViewArrays(view.image.numpy().astype(np.uint8, copy=False), depth_m, disparity_px)
