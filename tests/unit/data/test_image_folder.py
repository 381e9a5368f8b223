"""Folders of a user's own pictures, right and wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from cogmap.data.image_folder import CAMERA, CameraFile, read_images
from cogmap.errors import UsageError

DESCRIBED = """
fx_px = 55.0
fy_px = 54.0
cx_px = 31.5
cy_px = 23.5
baseline_m = 0.2
mount_height_m = 1.2
left_distortion = [-0.1, 0.01, 0.0, 0.0, 0.0]
rate_hz = 20.0
"""


def _folder(path: Path, names: tuple[str, ...] = ("9", "10", "11")) -> Path:
    rng = np.random.default_rng(0)
    for side in ("left", "right"):
        (path / side).mkdir(parents=True)
        for name in names:
            cv2.imwrite(str(path / side / f"{name}.png"), rng.integers(0, 256, (48, 64), np.uint8))
    (path / CAMERA).write_text(DESCRIBED)
    return path


def test_pairs_come_in_the_order_of_the_numbers_in_their_names_at_the_rate_of_the_file(
    tmp_path: Path,
) -> None:
    recording = read_images(_folder(tmp_path))

    assert [path.name for path in recording.left] == ["9.png", "10.png", "11.png"]
    assert recording.stamps_ns.tolist() == [0, 50_000_000, 100_000_000]
    calibration = recording.calibration
    assert (calibration.width_px, calibration.height_px) == (64, 48)
    assert (calibration.fx_px, calibration.fy_px) == (55.0, 54.0)
    assert calibration.left_distortion[0] == -0.1
    assert calibration.right_distortion == (0.0, 0.0, 0.0, 0.0, 0.0)
    assert recording.true_poses is None
    assert recording.pair(0)[0].shape == (48, 64)


def test_times_come_before_the_rate(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    (folder / "times.txt").write_text("5.0\n5.1\n5.3\n")

    assert read_images(folder).stamps_ns.tolist() == [5_000_000_000, 5_100_000_000, 5_300_000_000]


def test_a_pair_of_which_one_picture_is_missing_is_an_error_of_that_pair(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    (folder / "right" / "10.png").unlink()

    recording = read_images(folder)

    assert len(recording) == 3
    assert recording.pair(2)[0].shape == (48, 64)
    with pytest.raises(UsageError, match="there is no file"):
        recording.pair(1)


def _small_right(folder: Path) -> None:
    cv2.imwrite(str(folder / "right" / "9.png"), np.zeros((24, 32), np.uint8))


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda folder: (folder / CAMERA).unlink(), "has no camera.toml, its calibration"),
        (lambda folder: (folder / CAMERA).write_text("fx_px = "), "is no TOML"),
        (lambda folder: (folder / CAMERA).write_text("fx_px = 3.0"), "missing required field"),
        (
            lambda folder: (folder / CAMERA).write_text(DESCRIBED.replace("0.2", "-0.2")),
            "baseline_m",
        ),
        (
            lambda folder: (folder / CAMERA).write_text(DESCRIBED.replace("rate_hz = 20.0", "")),
            "neither times.txt nor a rate_hz",
        ),
        (_small_right, "is 32 x 24: give pictures of one size"),
        (lambda folder: (folder / "times.txt").write_text("1.0\n0.5\n2.0\n"), "is not after that"),
        (lambda folder: (folder / "times.txt").write_text("1.0\n"), "has 1 lines for 3 pairs"),
    ],
)
def test_what_is_wrong_is_one_sentence(
    tmp_path: Path, spoil: Callable[[Path], object], words: str
) -> None:
    folder = _folder(tmp_path)
    spoil(folder)

    with pytest.raises(UsageError, match=words):
        read_images(folder)


def test_an_empty_folder_is_said(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="has no whole pair of pictures"):
        read_images(_folder(tmp_path, names=()))


def test_the_example_of_the_documentation_is_read() -> None:
    import cogmap.data.image_folder as module

    assert module.__doc__ is not None
    example = [line for line in module.__doc__.splitlines() if line.startswith("    ")]
    keys = {line.split("=")[0].strip() for line in example if "=" in line}
    assert keys == set(CameraFile.__struct_fields__) - {"mount_forward_m"}
