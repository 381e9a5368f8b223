"""EuRoC folders, right and wrong."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from cogmap.data.euroc import read_euroc
from cogmap.errors import UsageError

FIRST_NS = 1_403_636_579_763_555_584
PERIOD_NS = 50_000_000
SENSOR = """
# General sensor definitions.
sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: [0.0, 0.0, 1.0, 0.3,
         -1.0, 0.0, 0.0, {left_m},
         0.0, -1.0, 0.0, 0.0,
         0.0, 0.0, 0.0, 1.0]
resolution: [{width}, 48]
camera_model: {model}
intrinsics: [{focal}, {focal}, 31.5, 23.5] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.05, 0.01, 0.0, 0.0]
"""
USUAL = {"left_m": 0.0, "width": 64, "focal": 55.0, "model": "pinhole"}
TRUTH = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], x, y, z\n"


def _sensor(folder: Path, **facts: object) -> None:
    (folder / "sensor.yaml").write_text(SENSOR.format(**(USUAL | facts)))


def _folder(path: Path, pairs: int = 3) -> Path:
    """Cameras on a body that looks along its x axis, z up, the right one 0.11 m to the right."""
    wall = np.random.default_rng(0).integers(0, 256, (48, 64), np.uint8)
    for camera, left_m, focal_px in (("cam0", 0.0, 55.0), ("cam1", -0.11, 56.0)):
        folder = path / "mav0" / camera
        (folder / "data").mkdir(parents=True)
        _sensor(folder, left_m=left_m, focal=focal_px)
        rows = ["#timestamp [ns],filename"]
        for number in range(pairs):
            stamp_ns = FIRST_NS + number * PERIOD_NS
            rows.append(f"{stamp_ns},{stamp_ns}.png")
            cv2.imwrite(str(folder / "data" / f"{stamp_ns}.png"), wall)
        (folder / "data.csv").write_text("\n".join(rows) + "\n")
    return path


def _truth(folder: Path, *rows: tuple[float, float, float]) -> None:
    """Poses of the body, at the stamps of the pairs: x, y and heading."""
    lines = [TRUTH]
    for number, (x_m, y_m, heading_rad) in enumerate(rows):
        half_rad = heading_rad / 2
        quaternion = f"{math.cos(half_rad)},0,0,{math.sin(half_rad)}"
        lines.append(f"{FIRST_NS + number * PERIOD_NS},{x_m},{y_m},1.5,{quaternion}\n")
    path = folder / "mav0" / "state_groundtruth_estimate0"
    path.mkdir()
    (path / "data.csv").write_text("".join(lines))


def test_a_sequence_is_rectified_to_a_parallel_pair(tmp_path: Path) -> None:
    recording = read_euroc(_folder(tmp_path))
    left, right = recording.pair(1)

    assert recording.calibration.baseline_m == pytest.approx(0.11)
    assert recording.calibration.left_distortion == (0.0, 0.0, 0.0, 0.0, 0.0)
    assert (recording.stamps_ns - FIRST_NS).tolist() == [0, PERIOD_NS, 2 * PERIOD_NS]
    assert left.shape == right.shape == (48, 64)
    assert left.min() > 0 or (left > 0).mean() > 0.9, "nothing outside of the pictures is shown"
    assert recording.true_poses is None


def test_one_point_lies_in_one_row_of_both_pictures_at_the_disparity_of_its_depth(
    tmp_path: Path,
) -> None:
    folder = _folder(tmp_path)
    point_m = np.array([2.0, 0.1, 0.15])  # ahead, left and up of the body
    for camera, left_m, focal_px in (("cam0", 0.0, 55.0), ("cam1", -0.11, 56.0)):
        ahead_m, aside_m, up_m = point_m - (0.3, left_m, 0.0)
        seen_px, _ = cv2.projectPoints(
            np.array([[-aside_m, -up_m, ahead_m]]),
            np.zeros(3),
            np.zeros(3),
            np.array([[focal_px, 0, 31.5], [0, focal_px, 23.5], [0, 0, 1]]),
            np.array([-0.05, 0.01, 0.0, 0.0]),
        )
        column, row = seen_px[0, 0]
        rows, columns = np.mgrid[0:48, 0:64]
        image = 255 * np.exp(-((columns - column) ** 2 + (rows - row) ** 2) / 8)
        path = folder / "mav0" / camera / "data" / f"{FIRST_NS}.png"
        cv2.imwrite(str(path), image.astype(np.uint8))

    recording = read_euroc(folder)
    (left_px, left_row), (right_px, right_row) = map(_middle, recording.pair(0))

    calibration = recording.calibration
    assert left_row == pytest.approx(right_row, abs=0.05)
    expected_px = calibration.fx_px * 0.11 / (2.0 - 0.3)
    assert left_px - right_px == pytest.approx(expected_px, abs=0.1)


def _middle(image: np.ndarray) -> tuple[float, float]:
    """Column and row of the middle of what is bright."""
    weights = image.astype(float)
    rows, columns = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
    total = weights.sum()
    return float((weights * columns).sum() / total), float((weights * rows).sum() / total)


def test_true_poses_are_those_of_the_camera_from_the_first_on(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    # It stands 0.3 m ahead of the body, which turns about itself on its way north.
    _truth(folder, (5.0, 1.0, math.pi / 2), (5.0, 2.0, math.pi / 2), (5.0, 2.0, math.pi))

    poses = read_euroc(folder).true_poses

    assert poses is not None
    expected = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.7, 0.3, math.pi / 2]]
    assert poses == pytest.approx(np.array(expected), abs=1e-6)


def test_where_nobody_measured_there_is_no_truth(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    _truth(folder, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))

    poses = read_euroc(folder).true_poses

    assert poses is not None
    assert np.isnan(poses[2]).all()
    assert np.isfinite(poses[:2]).all()


def test_a_rotation_of_no_length_is_said_with_its_line(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    _truth(folder, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    path = folder / "mav0" / "state_groundtruth_estimate0" / "data.csv"
    path.write_text(path.read_text() + f"{FIRST_NS + 2 * PERIOD_NS},1.0,0.0,1.5,0,0,0,0\n")

    with pytest.raises(UsageError, match="line 4"):
        read_euroc(folder)


def test_a_picture_without_a_partner_is_an_error_of_that_pair(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    rows = (folder / "mav0" / "cam1" / "data.csv").read_text().splitlines()
    (folder / "mav0" / "cam1" / "data.csv").write_text("\n".join([rows[0], rows[1], rows[3]]))
    (folder / "mav0" / "cam1" / "data" / f"{FIRST_NS + PERIOD_NS}.png").unlink()

    recording = read_euroc(folder)

    assert len(recording) == 3
    with pytest.raises(UsageError, match="there is no file"):
        recording.pair(1)


def _cam(folder: Path, number: int) -> Path:
    return folder / "mav0" / f"cam{number}"


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda folder: (_cam(folder, 0) / "sensor.yaml").unlink(), "has no sensor.yaml"),
        (lambda folder: (_cam(folder, 0) / "sensor.yaml").write_text("a: ["), "is no YAML"),
        (lambda folder: (_cam(folder, 0) / "sensor.yaml").write_text("[" * 19_000), "nested"),
        (lambda folder: (_cam(folder, 0) / "sensor.yaml").write_text("a: 1"), "intrinsics must be"),
        (lambda folder: _sensor(_cam(folder, 0), model="fisheye"), "camera_model is 'fisheye'"),
        (lambda folder: _sensor(_cam(folder, 1), left_m=-0.11, width=32), "pictures are 64 x 48"),
        (lambda folder: _sensor(_cam(folder, 1), left_m=0.11), "does not stand to the right"),
        (
            lambda folder: (_cam(folder, 0) / "data.csv").write_text("9,a.png\n5,b.png\n"),
            "is not after that",
        ),
        (lambda folder: (_cam(folder, 0) / "data.csv").write_text("#\n"), "has no pair"),
        (lambda folder: (_cam(folder, 0) / "data.csv").write_text("soon,a.png\n"), "line 1"),
    ],
)
def test_what_is_wrong_is_one_sentence(
    tmp_path: Path, spoil: Callable[[Path], object], words: str
) -> None:
    folder = _folder(tmp_path)
    spoil(folder)

    with pytest.raises(UsageError, match=words):
        read_euroc(folder)


def test_a_folder_of_another_kind_is_said(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="has no mav0/cam0"):
        read_euroc(tmp_path)
