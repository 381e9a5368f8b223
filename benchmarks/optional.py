"""Packages that some benchmarks compare with or measure by, and running Cogmap does not need."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats

REMEDY = "is not installed, and this benchmark needs it: run make bench-setup"


def gtsam() -> Any:
    """Load gtsam, which has no types. Raises UsageError if it is not installed."""
    try:
        import gtsam
    except ImportError:
        raise UsageError(f"gtsam {REMEDY}") from None

    return gtsam


def pfilter() -> Any:
    """Load pfilter, which has no types. Raises UsageError if it is not installed."""
    try:
        import pfilter  # type: ignore[import-untyped]
    except ImportError:
        raise UsageError(f"pfilter {REMEDY}") from None

    return pfilter.pfilter


def scikit_learn() -> Any:
    """Load scikit-learn, which has no types. Raises UsageError if it is not installed."""
    try:
        import sklearn.metrics
        import sklearn.mixture
    except ImportError:
        raise UsageError(f"scikit-learn {REMEDY}") from None

    return sklearn


def threadpoolctl() -> Any:
    """Load threadpoolctl, which has no types. Raises UsageError if it is not installed."""
    try:
        import threadpoolctl
    except ImportError:
        raise UsageError(f"threadpoolctl {REMEDY}") from None

    return threadpoolctl


def zenoh_ros2_sdk() -> Any:
    """Load zenoh-ros2-sdk. Raises UsageError if it, or mcap-ros2-support, is not installed."""
    try:
        import mcap_ros2._dynamic  # noqa: F401
        import zenoh_ros2_sdk.attachment
        import zenoh_ros2_sdk.entity
        import zenoh_ros2_sdk.keyexpr
        import zenoh_ros2_sdk.qos
        import zenoh_ros2_sdk.utils
    except ImportError:
        raise UsageError(f"zenoh-ros2-sdk or mcap-ros2-support {REMEDY}") from None

    return zenoh_ros2_sdk


def rosbags_types() -> Any:
    """Load the types of ROS 2 that rosbags has. Raises UsageError if it is not installed."""
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise UsageError(f"rosbags {REMEDY}") from None

    return get_typestore(Stores.ROS2_JAZZY)


def gtsam_poses(values: Any, keys: Iterable[int]) -> Floats:
    """Return (n, 3) poses in the plane, of gtsam's `values` at `keys`: x_m, y_m, heading_rad."""
    poses = []
    for key in keys:
        pose = values.atPose2(key)
        poses.append((pose.x(), pose.y(), pose.theta()))

    return np.array(poses)


def trajectory_error_m(positions_m: Floats, truth_m: Floats) -> float:
    """Return the root mean square distance of (n, 2) positions from the true ones, once aligned.

    They are aligned in the plane, by a rotation and a translation (Umeyama 1991); the scale stays.
    Raises UsageError if evo is not installed.
    """
    try:
        from evo.core.geometry import umeyama_alignment
        from evo.core.metrics import APE, PoseRelation, StatisticsType
        from evo.core.trajectory import PosePath3D
    except ImportError:
        raise UsageError(f"evo {REMEDY}") from None

    rotation, translation_m, _ = umeyama_alignment(positions_m.T, truth_m.T, with_scale=False)
    aligned_m = positions_m @ rotation.T + translation_m

    # The error is of positions: headings are left out.
    orientations = np.tile((1.0, 0.0, 0.0, 0.0), (len(truth_m), 1))
    truth = PosePath3D(_in_space(truth_m), orientations)
    aligned = PosePath3D(_in_space(aligned_m), orientations)

    error = APE(PoseRelation.translation_part)
    error.process_data((truth, aligned))
    return float(error.get_statistic(StatisticsType.rmse))


def _in_space(positions_m: Floats) -> Floats:
    """Return (n, 2) positions as (n, 3), on the ground."""
    heights_m = np.zeros(len(positions_m))
    return np.column_stack([positions_m, heights_m])
