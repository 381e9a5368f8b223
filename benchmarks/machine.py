"""The unit by which timings of two machines are compared."""

from __future__ import annotations

import time

import cv2
import numpy as np

from cogmap.geometry.arrays import Bytes

ROUNDS = 50
HEIGHT_PX = 240
WIDTH_PX = 320
DISPARITIES_PX = 64
BLOCK_PX = 5
SHIFT_PX = 12
SEED = 320


def machine_unit_ms() -> float:
    """The CPU time of one StereoSGBM on a fixed image: 320 x 240, 64 disparities, blocks of 5.

    It is the least of ROUNDS runs on one thread, so that other load on the machine hardly counts.
    """
    left, right = _pair()
    matcher = cv2.StereoSGBM.create(numDisparities=DISPARITIES_PX, blockSize=BLOCK_PX)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)

    try:
        return min(_cpu_ms(matcher, left, right) for _ in range(ROUNDS))
    finally:
        cv2.setNumThreads(threads)


def _pair() -> tuple[Bytes, Bytes]:
    """Smoothed noise, the same on every machine, and the same moved by SHIFT_PX."""
    rng = np.random.default_rng(SEED)
    noise = rng.integers(0, 256, (HEIGHT_PX, WIDTH_PX), np.uint8)
    smooth = cv2.GaussianBlur(noise, (5, 5), 0)

    left = np.asarray(smooth, np.uint8)
    right = np.roll(left, -SHIFT_PX, axis=1)
    return left, right


def _cpu_ms(matcher: cv2.StereoSGBM, left: Bytes, right: Bytes) -> float:
    began_s = time.process_time()
    matcher.compute(left, right)
    took_s = time.process_time() - began_s
    return 1e3 * took_s
