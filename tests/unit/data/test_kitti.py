"""KITTI folders, right and wrong."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from cogmap.data.kitti import read_kitti
from cogmap.errors import UsageError

CAMERA = "350 0 30 {} 0 350 20 0 0 0 1 0"
NAMED = f"P0: {CAMERA.format(0)}\nP1: {CAMERA.format(-189)}\nTr: 1 0 0 0\n"
UNNAMED = f"{CAMERA.format(0)}\n{CAMERA.format(-189)}\n"
# A metre forward (z), then one to the right (x), looking right.
POSES = "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 1\n0 0 1 1 0 1 0 0 -1 0 0 1\n"


def _folder(path: Path, left: str = "image_0", right: str = "image_1", pairs: int = 3) -> Path:
    rng = np.random.default_rng(0)
    for side in (left, right):
        (path / side).mkdir(parents=True)
        for number in range(pairs):
            image = rng.integers(0, 256, (40, 60), np.uint8)
            cv2.imwrite(str(path / side / f"{number:06}.png"), image)
    (path / "calib.txt").write_text(NAMED)
    (path / "times.txt").write_text("0.0\n1.036e-01\n0.2071\n")
    return path


def test_a_sequence_has_the_cameras_of_its_calibration(tmp_path: Path) -> None:
    recording = read_kitti(_folder(tmp_path))
    calibration = recording.calibration
    left, right = recording.pair(2)

    assert (calibration.width_px, calibration.height_px) == (60, 40)
    assert (calibration.fx_px, calibration.cx_px, calibration.cy_px) == (350, 30, 20)
    assert calibration.baseline_m == pytest.approx(0.54)
    assert recording.stamps_ns.tolist() == [0, 103_600_000, 207_100_000]
    assert recording.true_poses is None
    assert left.shape == right.shape == (40, 60)
    assert (left != right).any()


def test_a_reduced_folder_without_times_has_ten_pairs_a_second(tmp_path: Path) -> None:
    folder = _folder(tmp_path, "image_l", "image_r")
    (folder / "times.txt").unlink()
    (folder / "calib.txt").write_text(UNNAMED)

    recording = read_kitti(folder)

    assert recording.calibration.baseline_m == pytest.approx(0.54)
    assert recording.stamps_ns.tolist() == [0, 100_000_000, 200_000_000]


def test_colour_pictures_are_rgb(tmp_path: Path) -> None:
    folder = _folder(tmp_path, "image_2", "image_3")
    text = f"P2: {CAMERA.format(16)}\nP3: {CAMERA.format(-173)}\n"
    (folder / "calib.txt").write_text(text)
    red = np.full((40, 60, 3), (0, 0, 200), np.uint8)
    cv2.imwrite(str(folder / "image_2" / "000000.png"), red)

    recording = read_kitti(folder)

    assert recording.calibration.baseline_m == pytest.approx(0.54)
    assert recording.pair(0)[0][5, 5].tolist() == [200, 0, 0]


@pytest.mark.parametrize("where", ["here/poses.txt", "poses/07.txt"])
def test_true_poses_are_in_the_plane_x_forward_y_left(tmp_path: Path, where: str) -> None:
    folder = _folder(tmp_path / "sequences" / "07")
    path = folder / "poses.txt" if where == "here/poses.txt" else tmp_path / where
    path.parent.mkdir(exist_ok=True)
    path.write_text(POSES)

    poses = read_kitti(folder).true_poses

    assert poses is not None
    assert poses == pytest.approx(np.array([[0, 0, 0], [1, 0, 0], [1, -1, -np.pi / 2]]))


@pytest.mark.parametrize("side", ["image_0", "image_1"])
@pytest.mark.parametrize("broken", [True, False])
def test_a_pair_with_a_broken_or_missing_picture_is_an_error_of_its_own(
    tmp_path: Path, side: str, broken: bool
) -> None:
    folder = _folder(tmp_path)
    path = folder / side / "000001.png"
    if broken:
        path.write_bytes(path.read_bytes()[:-900])
    else:
        path.unlink()

    recording = read_kitti(folder)

    assert len(recording) == 3
    recording.pair(0)
    recording.pair(2)
    with pytest.raises(UsageError, match=f"{side}/000001.png"):
        recording.pair(1)


def test_a_picture_of_another_size_in_the_middle_is_an_error_of_its_pair(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    cv2.imwrite(str(folder / "image_0" / "000001.png"), np.zeros((40, 50), np.uint8))

    recording = read_kitti(folder)

    with pytest.raises(UsageError, match=r"000001\.png is 50 x 40, the camera's pictures are"):
        recording.pair(1)


def _without_pictures(folder: Path) -> None:
    for path in folder.glob("image_*/*.png"):
        path.unlink()


def _with_small_right_pictures(folder: Path) -> None:
    for path in folder.glob("image_1/*.png"):
        cv2.imwrite(str(path), np.zeros((20, 30), np.uint8))


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        (shutil.rmtree, "there is no folder"),
        (lambda folder: (folder / "calib.txt").unlink(), "has no calib.txt: give"),
        (lambda folder: shutil.rmtree(folder / "image_1"), "has no folders image_0 and image_1"),
        (lambda folder: (folder / "calib.txt").write_text("P0: 1 2\n"), "line 1: expected"),
        (lambda folder: (folder / "calib.txt").write_text(f"{CAMERA.format(0)}\n"), "no matrix P1"),
        (
            lambda folder: (folder / "calib.txt").write_text(f"{CAMERA.format(0)}\n" * 2),
            "not of two rectified cameras",
        ),
        (lambda folder: (folder / "times.txt").write_text("0\n0.2\n0.1\n"), "stamp of pair 2"),
        (lambda folder: (folder / "times.txt").write_text("0\n0.2\n"), "has 2 lines, but"),
        (lambda folder: (folder / "times.txt").write_text("0\nnan\n1\n"), "line 2: expected"),
        (lambda folder: (folder / "times.txt").write_text("0\n1\n1e10\n"), "line 3: expected"),
        (lambda folder: (folder / "poses.txt").write_text(POSES[:60]), "poses.txt"),
        (lambda folder: (folder / "image_0" / "a.png").touch(), "are numbers"),
        (lambda folder: (folder / "image_0" / f"{10**19}.png").touch(), "are numbers"),
        (_without_pictures, "has no whole pair"),
        (_with_small_right_pictures, "is 60 x 40, .* is 30 x 20: give pictures"),
    ],
)
def test_a_wrong_folder_is_refused_with_a_remedy(
    tmp_path: Path, damage: Callable[[Path], object], expected: str
) -> None:
    folder = _folder(tmp_path / "drive")
    damage(folder)

    with pytest.raises(UsageError, match=expected):
        read_kitti(folder)
