"""Packages that some benchmarks compare with or measure by, and running Cogmap does not need."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats

REMEDY = "is not installed, and this benchmark needs it: run make bench-setup"


def gtsam() -> Any:
    """The package gtsam, which has no types. Raises UsageError if it is not installed."""
    try:
        import gtsam
    except ImportError:
        raise UsageError(f"gtsam {REMEDY}") from None

    return gtsam


def scikit_learn() -> Any:
    """The package scikit-learn, which has no types. Raises UsageError if it is not installed."""
    try:
        import sklearn.metrics
        import sklearn.mixture
    except ImportError:
        raise UsageError(f"scikit-learn {REMEDY}") from None

    return sklearn


def threadpoolctl() -> Any:
    """The package threadpoolctl, which has no types. Raises UsageError if it is missing."""
    try:
        import threadpoolctl
    except ImportError:
        raise UsageError(f"threadpoolctl {REMEDY}") from None

    return threadpoolctl


def gtsam_poses(values: Any, keys: Iterable[int]) -> Floats:
    """(n, 3) poses in the plane, of gtsam's `values` at `keys`: x_m, y_m, heading_rad."""
    poses = []
    for key in keys:
        pose = values.atPose2(key)
        poses.append((pose.x(), pose.y(), pose.theta()))

    return np.array(poses)
