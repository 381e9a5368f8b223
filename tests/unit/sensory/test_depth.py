"""Rectification, depth and range scan on scenes whose geometry is known."""

from __future__ import annotations

import cv2
import msgspec
import numpy as np
import numpy.typing as npt
import pytest

from cogmap.errors import MessageError
from schemas.sensing import Calibration
from services.sensory.disparity import DepthFromStereo
from services.sensory.rectify import rectification
from services.sensory.scan import scan

WIDTH = 320
HEIGHT = 240
FOCAL_PX = 208.0
BASELINE_M = 0.5
CALIBRATION = Calibration(
    width_px=WIDTH,
    height_px=HEIGHT,
    fx_px=FOCAL_PX,
    fy_px=FOCAL_PX,
    cx_px=(WIDTH - 1) / 2,
    cy_px=(HEIGHT - 1) / 2,
    baseline_m=BASELINE_M,
    mount_height_m=1.5,
    mount_forward_m=0.3,
)
Image = npt.NDArray[np.uint8]


def _texture() -> npt.NDArray[np.float32]:
    rng = np.random.default_rng(3)
    total = np.full((1024, 2048), 128, np.float32)
    for cells in (16, 32, 64, 128, 256):
        total += 12 * cv2.resize(
            rng.standard_normal((cells, 2 * cells)), (2048, 1024), interpolation=cv2.INTER_CUBIC
        )

    return total


def _wall(
    depth_m: float, turn_rad: tuple[float, float, float] = (0, 0, 0), distortion: float = 0.0
) -> list[Image]:
    """The pair that sees a wall across the view at `depth_m`; the right camera turned by
    `turn_rad`.
    """
    texture = _texture()
    rng = np.random.default_rng(0)
    rotation, _ = cv2.Rodrigues(np.array(turn_rad, float))
    rays = _rays(distortion)
    images = []
    for turn, x_m in ((np.eye(3), 0.0), (rotation, BASELINE_M)):
        seen = rays @ turn.T
        x = x_m + seen[..., 0] / seen[..., 2] * depth_m
        y = seen[..., 1] / seen[..., 2] * depth_m
        scale = FOCAL_PX / depth_m
        picture = cv2.remap(
            texture,
            (x * scale + 1000).astype(np.float32),
            (y * scale + 500).astype(np.float32),
            cv2.INTER_LINEAR,
        )
        picture = np.clip(picture + rng.normal(0, 1.5, picture.shape), 0, 255)
        images.append(np.repeat(picture[..., None], 3, axis=2).astype(np.uint8))

    return images


def _rays(distortion: float) -> npt.NDArray[np.float64]:
    u, v = np.meshgrid(np.arange(WIDTH, dtype=float), np.arange(HEIGHT, dtype=float))
    camera = np.array(
        [[FOCAL_PX, 0, CALIBRATION.cx_px], [0, FOCAL_PX, CALIBRATION.cy_px], [0, 0, 1]]
    )
    pixels = np.stack([u.ravel(), v.ravel()], 1)[:, None]
    plane = cv2.undistortPoints(pixels, camera, np.array([distortion, 0, 0, 0, 0])).reshape(
        HEIGHT, WIDTH, 2
    )

    return np.concatenate([plane, np.ones((HEIGHT, WIDTH, 1))], axis=2)


@pytest.mark.parametrize(
    ("depth_m", "bar"), [(3.0, 0.01), (8.3, 0.015), (12.0, 0.02), (29.0, 0.04)]
)
def test_depth_is_right_from_three_to_thirty_metres_over_the_whole_image(
    depth_m: float, bar: float
) -> None:
    depth = DepthFromStereo(CALIBRATION, 2.5).depth_m(*_wall(depth_m))

    assert depth.dtype == np.float32

    known = depth > 0
    overlap = known[:, 40:]

    assert overlap.mean() > 0.9
    assert np.median(np.abs(depth[known] - depth_m)) < bar * depth_m


def test_distant_things_have_depth_at_the_left_border_too() -> None:
    depth = DepthFromStereo(CALIBRATION, 2.5).depth_m(*_wall(25.0))

    assert (depth[:, 8:40] > 0).mean() > 0.8


def test_a_view_without_texture_has_no_depth() -> None:
    blank = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)

    assert (DepthFromStereo(CALIBRATION, 2.5).depth_m(blank, blank) > 0).mean() < 0.01


def test_a_turned_right_camera_and_lens_distortion_are_undone() -> None:
    turn_rad = (0.02, -0.015, 0.02)
    distortion = -0.08
    lens = (distortion, 0.0, 0.0, 0.0, 0.0)
    given = msgspec.structs.replace(
        CALIBRATION, right_rotation_rad=turn_rad, left_distortion=lens, right_distortion=lens
    )
    images = _wall(10.0, turn_rad, distortion)
    rectified = rectification(given)

    assert rectified.calibration == CALIBRATION

    depth = DepthFromStereo(rectified.calibration, 2.5).depth_m(
        *rectified.apply(images[0], images[1])
    )
    middle = depth[40:-40, 60:-40]

    assert (middle > 0).mean() > 0.9
    assert np.median(np.abs(middle[middle > 0] - 10.0)) < 0.1


def test_rectified_images_are_passed_on_untouched_and_maps_are_made_once() -> None:
    left, right = _wall(5.0)
    first = rectification(CALIBRATION)
    second = rectification(msgspec.structs.replace(CALIBRATION))

    assert first is second
    assert first.apply(left, right)[0] is left


@pytest.mark.parametrize(
    "wrong", [{"fx_px": 0.0}, {"fy_px": 1e6}, {"cx_px": 1000.0}, {"cy_px": 241.0}]
)
def test_a_calibration_of_no_camera_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(MessageError, match="calibration"):
        rectification(msgspec.structs.replace(CALIBRATION, **wrong))


def test_the_scan_finds_an_obstacle_at_its_bearing_and_range_only() -> None:
    depth = np.zeros((HEIGHT, WIDTH), np.float32)
    depth[120:150, 40:60] = 8.0
    bearing_rad, range_m = scan(depth, CALIBRATION, 32)
    hit = range_m > 0
    x = 8.3
    y = (CALIBRATION.cx_px - 50) / FOCAL_PX * 8.0

    assert 1 <= hit.sum() <= 4
    assert abs(bearing_rad[hit].mean() - np.arctan2(y, x)) < 0.05

    np.testing.assert_allclose(range_m[hit], np.hypot(x, y), rtol=0.03)


def test_the_scan_ignores_the_ground_and_what_hangs_above_the_robot() -> None:
    depth = np.zeros((HEIGHT, WIDTH), np.float32)
    rows = np.arange(140, HEIGHT)
    depth[rows] = (1.5 * FOCAL_PX / (rows - CALIBRATION.cy_px))[:, None]
    depth[:60] = 6.0

    assert not scan(depth, CALIBRATION, 32)[1].any()


def test_a_wrong_match_or_two_are_no_obstacle() -> None:
    depth = np.zeros((HEIGHT, WIDTH), np.float32)
    depth[120:122, 100] = 3.0
    depth[110:150, 90:110] = np.where(depth[110:150, 90:110] > 0, depth[110:150, 90:110], 20.0)
    range_m = scan(depth, CALIBRATION, 32)[1]

    assert range_m[range_m > 0].min() > 15
