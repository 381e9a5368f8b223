"""The arrays of a view, after checks that they fit each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Bytes, Singles
from cogmap.schemas.sensing import Calibration, View

MIN_FOCAL_LENGTH_PX = 1.0


@dataclass(frozen=True, eq=False)
class ViewArrays:
    """RGB `image`, uint8 (h, w, 3), with its depth in metres and its disparity in pixels, float32
    (h, w), 0 where unknown.
    """

    image: Bytes
    depth_m: Singles
    disparity_px: Singles


def view_arrays(view: View) -> ViewArrays:
    """Return the arrays of `view`. Raises MessageError if image, depth and calibration do not fit
    each other.
    """
    _check_layout(view)
    camera = view.calibration
    depth_m = view.depth_m.numpy().astype(np.float32, copy=False)

    if min(camera.fx_px, camera.fy_px) < MIN_FOCAL_LENGTH_PX:
        raise MessageError("view: its calibration's focal lengths must be at least 1 pixel")
    if (depth_m < 0).any():
        raise MessageError("view: depth is negative")

    return ViewArrays(
        image=view.image.numpy().astype(np.uint8, copy=False),
        depth_m=depth_m,
        disparity_px=_disparity_px(depth_m, camera),
    )


def _check_layout(view: View) -> None:
    camera = view.calibration
    size = (camera.height_px, camera.width_px)
    image = view.image
    depth_m = view.depth_m

    if (image.dtype, image.shape) != ("|u1", (*size, 3)):
        raise MessageError(
            f"view: expected a uint8 image {(*size, 3)}, got {image.dtype} {image.shape}"
        )
    if (depth_m.dtype, depth_m.shape) != ("<f4", size):
        raise MessageError(
            f"view: expected float32 depth {size}, got {depth_m.dtype} {depth_m.shape}"
        )


def _disparity_px(depth_m: Singles, camera: Calibration) -> Singles:
    """Disparities beyond the image's width cannot be matched and count as unknown."""
    focal_baseline = np.float32(camera.fx_px * camera.baseline_m)
    nearest_m = focal_baseline / camera.width_px

    known = depth_m > nearest_m
    unknown = np.zeros(depth_m.shape, np.float32)
    return np.divide(focal_baseline, depth_m, out=unknown, where=known)
