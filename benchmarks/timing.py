"""The timing of code, and the unit by which timings of two machines are compared."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import cv2
import numpy as np

T = TypeVar("T")


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """Return the seconds that `work` took, and what it returned."""
    began_s = time.perf_counter()
    result = work()
    return time.perf_counter() - began_s, result


def least_cpu_s(work: Callable[[], object], rounds: int) -> float:
    """Return the least CPU time of `rounds` calls, of all threads together, so that other load on
    the machine hardly counts.
    """
    times_s = []
    for _ in range(rounds):
        began_s = time.process_time()
        work()
        times_s.append(time.process_time() - began_s)

    return min(times_s)


def machine_unit_ms() -> float:
    """Return the CPU time of one StereoSGBM on a fixed image: 320 x 240, 64 disparities, blocks of
    5. It is the least of 50, on one thread.
    """
    # Smoothed noise, the same on every machine, and the same moved by 12 pixels.
    noise = np.random.default_rng(320).integers(0, 256, (240, 320), np.uint8)
    left = np.asarray(cv2.GaussianBlur(noise, (5, 5), 0), np.uint8)
    right = np.roll(left, -12, axis=1)

    matcher = cv2.StereoSGBM.create(numDisparities=64, blockSize=5)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        return 1e3 * least_cpu_s(lambda: matcher.compute(left, right), rounds=50)
    finally:
        cv2.setNumThreads(threads)
