"""What CameraInfo says, as the calibration of a pair; and where the cameras stand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cogmap.data.bags.bag import Bag
from cogmap.data.bags.cameras import CameraInfo, pair_of
from cogmap.data.bags.pairs import read_pairs
from cogmap.data.bags.topics import Topics
from cogmap.geometry.arrays import Floats
from tests.support.bags import BagMaker, cameras, frames

MATRIX = np.array([[50.0, 0.0, 31.5], [0.0, 51.0, 23.5], [0.0, 0.0, 1.0]])
MOUNT = {"mount_height_m": 1.2, "mount_forward_m": 0.1}
LENS = (-0.1, 0.01, 0.0, 0.0)


def _camera(
    baseline_m: float = 0.0, matrix: Floats = MATRIX, distortion: tuple[float, ...] = LENS
) -> CameraInfo:
    return CameraInfo(
        frame="eye",
        width_px=64,
        height_px=48,
        model="plumb_bob",
        matrix=matrix,
        distortion=np.array(distortion),
        turn=np.eye(3),
        seen=np.column_stack([MATRIX, [-50.0 * baseline_m, 0.0, 0.0]]),
    )


def test_lenses_that_our_calibration_can_describe_are_left_to_sensory_memory() -> None:
    pair = pair_of(_camera(), _camera(0.2), False, MOUNT, "bag")

    assert pair.maps is None
    assert pair.calibration.left_distortion == (*LENS, 0.0)
    assert pair.calibration.right_rotation_rad == (0.0, 0.0, 0.0)
    assert pair.calibration.baseline_m == pytest.approx(0.2)
    assert (pair.calibration.fx_px, pair.calibration.fy_px) == (50.0, 51.0)


def test_cameras_of_two_matrices_are_rectified_as_they_are_read() -> None:
    wider = MATRIX * [[0.8], [0.8], [1.0]]

    pair = pair_of(_camera(), _camera(0.2, wider), False, MOUNT, "bag")

    assert pair.maps is not None
    assert pair.calibration.left_distortion == (0.0,) * 5
    (columns, _), (columns_of_wider, _) = pair.maps
    assert np.ptp(columns_of_wider) < np.ptp(columns)


def test_lenses_of_images_that_are_rectified_are_of_no_matter() -> None:
    pair = pair_of(_camera(), _camera(0.2, distortion=(0.5,) * 8), True, MOUNT, "bag")

    assert pair.maps is None
    assert pair.calibration.right_distortion == (0.0,) * 5


def _height_and_forward_m(path: Path, given_m: float = 0.0) -> tuple[float, float]:
    calibration = read_pairs(Bag(path), Topics(), given_m).calibration
    return calibration.mount_height_m, calibration.mount_forward_m


def test_static_transforms_say_where_the_cameras_stand(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker)
        maker.static("head", "left_eye", (0.0, 0.0, 0.0))
        maker.static("base_link", "head", (0.3, 0.0, 1.5))

    assert _height_and_forward_m(tmp_path / "bag") == pytest.approx((1.5, 0.3))
    assert _height_and_forward_m(tmp_path / "bag", 2.0) == pytest.approx((2.0, 0.3))


def test_cameras_of_which_nothing_says_where_they_stand_are_held_in_a_hand(tmp_path: Path) -> None:
    with BagMaker(tmp_path / "bag") as maker:
        cameras(maker)
        frames(maker)

    assert _height_and_forward_m(tmp_path / "bag") == (1.0, 0.0)
