"""Self-motion measured on a recorded drive, here of a street that is drawn."""

from __future__ import annotations

from pathlib import Path

import cv2
import pytest

from benchmarks.real import stereo
from cogmap.errors import UsageError
from tests.support.world.stereo_street import CAMERA, pair

STEP_M = 0.5
FRAMES = 8


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A KITTI folder of a straight drive."""
    focal = f"{CAMERA.fx_px} 0 {CAMERA.cx_px}"
    rows = f"0 {CAMERA.fy_px} {CAMERA.cy_px} 0 0 0 1 0"
    shift = -CAMERA.fx_px * CAMERA.baseline_m
    (tmp_path / "calib.txt").write_text(f"P0: {focal} 0 {rows}\nP1: {focal} {shift} {rows}\n")
    poses = [f"1 0 0 0 0 1 0 0 0 0 1 {STEP_M * number}" for number in range(FRAMES)]
    (tmp_path / "poses.txt").write_text("\n".join(poses))

    for number in range(FRAMES):
        for side, image in zip(
            ("image_0", "image_1"), pair((STEP_M * number, 0.0, 0.0)), strict=True
        ):
            (tmp_path / side).mkdir(exist_ok=True)
            cv2.imwrite(str(tmp_path / side / f"{number:06}.png"), image)
    return tmp_path


def test_the_drift_of_views_is_measured_beside_that_of_opencvs_parts(folder: Path) -> None:
    metrics = stereo.measure(folder)

    assert metrics["distance_m"] == pytest.approx(STEP_M * (FRAMES - 1))
    assert metrics["drift_share"] < 0.02
    assert metrics["plain_drift_share"] < 0.1
    share = metrics["drift_share"] / metrics["plain_drift_share"]
    assert metrics["drift_over_pnp"] == pytest.approx(share)
    assert metrics["frame_ms_p50"] > 0
    assert metrics["distance_chi2"] < 10


def test_a_broken_pair_is_skipped_and_counted(folder: Path) -> None:
    (folder / "image_1" / "000004.png").write_bytes(b"broken")
    metrics = stereo.measure(folder)

    assert metrics["skipped_pairs"] == 1
    assert metrics["frames"] == FRAMES - 1
    assert metrics["drift_share"] < 0.02


def test_a_drive_without_true_poses_is_refused(folder: Path) -> None:
    (folder / "poses.txt").unlink()
    with pytest.raises(UsageError, match=r"has no poses\.txt: give a drive"):
        stereo.measure(folder)
