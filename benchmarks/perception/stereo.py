"""Our stereo matching against plain StereoSGBM that is padded as ours is, on a rectified pair of a
user's own.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from benchmarks.report import Metrics
from benchmarks.threshold import less_than
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Bytes, Singles
from cogmap.services.sensory.public import STEPS_PER_PIXEL, StereoMatcher

OFF_PX = (1, 3)
PLAIN_BLOCK_PX = 3
SMALLEST_SHARE = 1e-9
THRESHOLDS = {f"stereo_off_{px}px_over_plain": less_than(1.0) for px in OFF_PX}
Image = npt.NDArray[Any]


def measure(left: Path, right: Path, disparity: Path, scale: float) -> Metrics:
    """Measure the shares of pixels whose disparity errs by more than OFF_PX, ours and StereoSGBM's.

    They are shares of all pixels whose truth is known; a pixel without a match counts as wrong, for
    both. `*_together_*` is of the pixels only that both match. Raises UsageError if a file is
    missing, no image, or of another size.
    """
    left_rgb = _read_rgb(left)
    right_rgb = _read_rgb(right)
    true_px = _truth(disparity, scale)
    _check_size(right, right_rgb, left, left_rgb)
    _check_size(disparity, true_px, left, left_rgb)
    return compared(left_rgb, right_rgb, true_px)


def compared(left: Bytes, right: Bytes, true_px: Singles) -> Metrics:
    """Compute the metrics of `measure`, of images (h, w, 3) and true disparities (h, w)."""
    most_px = float(true_px.max())
    matcher = StereoMatcher(most_px)
    ours = matcher.disparity_px(left, right)
    unrefined = matcher.disparity_px(left, right, refine=False)
    plain = plain_sgbm(left, right, most_px)
    is_matched = (ours > 0) & (plain > 0)
    in_both = np.where(is_matched, true_px, np.float32(0))

    metrics = _off("stereo", ours, true_px) | _off("plain", plain, true_px)
    metrics |= _off("unrefined", unrefined, true_px)
    metrics |= _off("stereo_together", ours, in_both) | _off("plain_together", plain, in_both)
    metrics["stereo_unmatched"] = unmatched(ours, true_px)
    metrics["plain_unmatched"] = unmatched(plain, true_px)

    for px in OFF_PX:
        key = f"stereo_off_{px}px"
        plain_share = max(metrics[f"plain_off_{px}px"], SMALLEST_SHARE)
        metrics[f"{key}_over_plain"] = metrics[key] / plain_share

    return metrics


def _check_size(path: Path, image: Image, left: Path, left_image: Image) -> None:
    """Raise UsageError if an image is of another size than the left one."""
    size = _size(image)
    left_size = _size(left_image)
    if size != left_size:
        raise UsageError(f"{path} is {size}, but {left} {left_size}: they must be of one size")


def _size(image: Image) -> str:
    height_px, width_px, *_ = image.shape
    return f"{width_px} x {height_px}"


def _off(name: str, found_px: Singles, true_px: Singles) -> Metrics:
    return {f"{name}_off_{px}px": off_share(found_px, true_px, px) for px in OFF_PX}


def off_share(found_px: Singles, true_px: Singles, most_px: float) -> float:
    """Return the share of the pixels with a true disparity, over 0, that errs by more than
    `most_px`, or is not found, 0. NaN if no pixel has one.
    """
    is_known = true_px > 0
    if not is_known.any():
        return math.nan

    error_px = np.abs(found_px - true_px)
    is_wrong = (found_px <= 0) | (error_px > most_px)
    return float(is_wrong[is_known].mean())


def unmatched(found_px: Singles, true_px: Singles) -> float:
    """Return the share of the pixels with a true disparity for which none was found."""
    return off_share(found_px, true_px, math.inf)


def plain_sgbm(left: Bytes, right: Bytes, most_px: float) -> Singles:
    """Match grey images by StereoSGBM as OpenCV's documentation sets it up, padded so that it
    matches the left border, too. Returns disparities, float32 (h, w), 0 unmatched.
    """
    left_grey = np.asarray(cv2.cvtColor(left, cv2.COLOR_RGB2GRAY), np.uint8)
    right_grey = np.asarray(cv2.cvtColor(right, cv2.COLOR_RGB2GRAY), np.uint8)
    return plain_disparity_px(left_grey, right_grey, most_px)


def plain_disparity_px(left: Bytes, right: Bytes, most_px: float) -> Singles:
    """Return what `plain_sgbm` does, of grey images (h, w)."""
    area = PLAIN_BLOCK_PX**2
    disparities = max(16, 16 * math.ceil(most_px / 16))
    matcher = cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=disparities,
        blockSize=PLAIN_BLOCK_PX,
        P1=8 * area,
        P2=32 * area,
        disp12MaxDiff=1,
        uniquenessRatio=10,
        speckleWindowSize=100,
        speckleRange=32,
    )
    padding = (0, 0, disparities, 0)
    padded = [cv2.copyMakeBorder(grey, *padding, cv2.BORDER_REPLICATE) for grey in (left, right)]
    steps = matcher.compute(*padded)[:, disparities:]

    matched = np.maximum(steps, 0).astype(np.float32)
    return matched / np.float32(STEPS_PER_PIXEL)


def _read_rgb(path: Path) -> Bytes:
    image = cv2.cvtColor(_read(path, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    return image.astype(np.uint8, copy=False)


def _read(path: Path, flags: int) -> Image:
    if not path.is_file():
        raise UsageError(f"there is no file {path}: name the image")

    data = np.frombuffer(path.read_bytes(), np.uint8)
    image = cv2.imdecode(data, flags) if data.size else None
    if image is None:
        raise UsageError(
            f"{path} is no image that can be read: give a PNG or another common format"
        )

    return image


def _truth(path: Path, scale: float) -> Singles:
    values = _read(path, cv2.IMREAD_UNCHANGED)
    if values.ndim != 2:
        raise UsageError(
            f"{path} is a colour image: give the disparities as one channel, 0 where unknown"
        )

    true_px = values.astype(np.float32) / np.float32(scale)
    if not np.isfinite(true_px).all() or not (true_px > 0).any():
        raise UsageError(
            f"{path} holds no disparity over 0: give --scale times the left image's disparities"
        )

    _, width_px = values.shape
    if true_px.max() >= width_px:
        raise UsageError(
            f"{path} holds disparities wider than the image: give the --scale of its writing"
        )

    return true_px
