"""Rectification, depth and range scan on scenes whose geometry is known."""

from __future__ import annotations

import cv2
import msgspec
import numpy as np
import numpy.typing as npt
import pytest

from cogmap.errors import MessageError
from cogmap.schemas.sensing import Calibration
from cogmap.services.sensory.disparity import DepthFromStereo, refined
from cogmap.services.sensory.rectify import rectification
from cogmap.services.sensory.scan import scan

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
SHAPE = (HEIGHT, WIDTH)


def _texture() -> npt.NDArray[np.float32]:
    rng = np.random.default_rng(3)
    total = np.full((1024, 2048), 128, np.float32)
    for cells in (16, 32, 64, 128, 256):
        coarse = rng.standard_normal((cells, 2 * cells))
        total += 12 * cv2.resize(coarse, (2048, 1024), interpolation=cv2.INTER_CUBIC)

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
        right_m = x_m + seen[..., 0] / seen[..., 2] * depth_m
        down_m = seen[..., 1] / seen[..., 2] * depth_m
        column = right_m * FOCAL_PX / depth_m + 1000
        row = down_m * FOCAL_PX / depth_m + 500
        grey = cv2.remap(
            texture, column.astype(np.float32), row.astype(np.float32), cv2.INTER_LINEAR
        )

        noisy = np.clip(grey + rng.normal(0, 1.5, grey.shape), 0, 255)
        images.append(np.repeat(noisy[..., None], 3, axis=2).astype(np.uint8))

    return images


def _rays(distortion: float) -> npt.NDArray[np.float64]:
    """(HEIGHT, WIDTH, 3): the direction that each pixel sees, through a distorting lens."""
    rows, columns = np.indices(SHAPE, dtype=float)
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=1)[:, None]
    camera = np.diag([FOCAL_PX, FOCAL_PX, 1.0])
    camera[:2, 2] = CALIBRATION.cx_px, CALIBRATION.cy_px
    lens = np.array([distortion, 0, 0, 0, 0])

    plane = cv2.undistortPoints(pixels, camera, lens).reshape(*SHAPE, 2)
    ahead = np.ones((*SHAPE, 1))
    return np.concatenate([plane, ahead], axis=2)


def _depth_m(left: Image, right: Image) -> npt.NDArray[np.float32]:
    return DepthFromStereo(CALIBRATION, 2.5).depth_m(left, right)


def test_depth_does_not_depend_on_the_number_of_opencvs_threads() -> None:
    left, right = _wall(12.0, turn_rad=(0.0, 0.02, 0.0))
    depth = DepthFromStereo(CALIBRATION, nearest_m=2.0)
    threads = cv2.getNumThreads()

    found = []
    try:
        for number in (1, 2, 5):
            cv2.setNumThreads(number)
            found.append(depth.depth_m(left, right))
    finally:
        cv2.setNumThreads(threads)

    alone, *others = found
    assert (alone > 0).any()
    assert all((other == alone).all() for other in others)


@pytest.mark.parametrize(
    ("depth_m", "bar"), [(3.0, 0.01), (8.3, 0.015), (12.0, 0.02), (29.0, 0.04)]
)
def test_depth_is_right_from_three_to_thirty_metres_over_the_whole_image(
    depth_m: float, bar: float
) -> None:
    found_m = _depth_m(*_wall(depth_m))
    known = found_m > 0
    error_m = np.abs(found_m[known] - depth_m)

    assert found_m.dtype == np.float32
    assert known[:, 40:].mean() > 0.9
    assert np.median(error_m) < bar * depth_m


def test_distant_things_have_depth_at_the_left_border_too() -> None:
    depth_m = _depth_m(*_wall(25.0))
    at_border = depth_m[:, 8:40]

    assert (at_border > 0).mean() > 0.8


def test_a_view_without_texture_has_no_depth() -> None:
    blank = np.full((*SHAPE, 3), 128, np.uint8)
    depth_m = _depth_m(blank, blank)

    assert (depth_m > 0).mean() < 0.01


def test_a_turned_right_camera_and_lens_distortion_are_undone() -> None:
    turn_rad = (0.02, -0.015, 0.02)
    distortion = -0.08
    lens = (distortion, 0.0, 0.0, 0.0, 0.0)
    given = msgspec.structs.replace(
        CALIBRATION, right_rotation_rad=turn_rad, left_distortion=lens, right_distortion=lens
    )
    rectified = rectification(given)
    assert rectified.calibration == CALIBRATION

    left, right = _wall(10.0, turn_rad, distortion)
    depth_m = _depth_m(*rectified.apply(left, right))
    middle_m = depth_m[40:-40, 60:-40]
    known_m = middle_m[middle_m > 0]
    assert known_m.size > 0.9 * middle_m.size
    assert np.median(np.abs(known_m - 10.0)) < 0.1


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
    calibration = msgspec.structs.replace(CALIBRATION, **wrong)

    with pytest.raises(MessageError, match="calibration"):
        rectification(calibration)


def test_the_scan_finds_an_obstacle_at_its_bearing_and_range_only() -> None:
    depth_m = np.zeros(SHAPE, np.float32)
    depth_m[120:150, 40:60] = 8.0
    ahead_m = 8.0 + CALIBRATION.mount_forward_m
    left_m = (CALIBRATION.cx_px - 50) / FOCAL_PX * 8.0

    bearing_rad, range_m = scan(depth_m, CALIBRATION)

    hit = range_m > 0
    assert 1 <= hit.sum() <= 4
    assert abs(bearing_rad[hit].mean() - np.arctan2(left_m, ahead_m)) < 0.05
    np.testing.assert_allclose(range_m[hit], np.hypot(ahead_m, left_m), rtol=0.03)


def test_the_scan_ignores_the_ground_and_what_hangs_above_the_robot() -> None:
    rows = np.arange(140, HEIGHT)
    ground_m = CALIBRATION.mount_height_m * FOCAL_PX / (rows - CALIBRATION.cy_px)
    depth_m = np.zeros(SHAPE, np.float32)
    depth_m[rows] = ground_m[:, None]
    depth_m[:60] = 6.0

    _, range_m = scan(depth_m, CALIBRATION)
    assert not range_m.any()


@pytest.mark.parametrize(("focal_px", "sectors"), [(208.0, 32), (400.0, 19), (100.0, 50)])
def test_sectors_are_of_one_angle_whatever_the_camera_sees(focal_px: float, sectors: int) -> None:
    camera = msgspec.structs.replace(CALIBRATION, fx_px=focal_px)
    bearing_rad, range_m = scan(np.zeros(SHAPE, np.float32), camera)

    assert len(bearing_rad) == len(range_m) == sectors
    assert np.diff(bearing_rad) == pytest.approx(np.radians(-75 / 32), rel=0.05)


def test_the_ground_is_no_obstacle_to_a_camera_that_is_tilted_as_its_way_shows() -> None:
    slope = -0.03
    rows = np.arange(120, HEIGHT)
    down = (rows - CALIBRATION.cy_px) / FOCAL_PX
    depth_m = np.zeros(SHAPE, np.float32)
    depth_m[rows] = (CALIBRATION.mount_height_m / (down - slope))[:, None]

    _, level_m = scan(depth_m, CALIBRATION)
    _, tilted_m = scan(depth_m, CALIBRATION, slope)
    assert level_m.any()
    assert not tilted_m.any()


def test_a_wrong_match_or_two_are_no_obstacle() -> None:
    depth_m = np.zeros(SHAPE, np.float32)
    depth_m[110:150, 90:110] = 20.0
    depth_m[120:122, 100] = 3.0

    _, range_m = scan(depth_m, CALIBRATION)
    assert range_m[range_m > 0].min() > 15


def test_a_disparity_stays_where_a_step_makes_the_windows_differ_no_less() -> None:
    texture = _texture()
    left = np.ascontiguousarray(texture[:HEIGHT, :WIDTH])
    hidden = np.ascontiguousarray(texture[400 : 400 + HEIGHT, :WIDTH])
    matched_px = np.full(SHAPE, 8.0, np.float32)

    stays = refined(matched_px, left, hidden) == matched_px

    assert 0.05 < stays.mean() < 0.5


def test_where_two_surfaces_meet_the_disparity_stays_as_it_was_matched() -> None:
    left, right = (image[..., 0].astype(np.float32) for image in _wall(10.0))
    matched_px = np.full(SHAPE, 10.2, np.float32)
    matched_px[:, WIDTH // 2 :] = 30.0
    near_the_edge = np.s_[:, WIDTH // 2 - 4 : WIDTH // 2 + 4]

    refined_px = refined(matched_px, left, right)

    assert np.array_equal(refined_px[near_the_edge], matched_px[near_the_edge])
    true_px = FOCAL_PX * BASELINE_M / 10.0
    on_the_wall_px = refined_px[20:-20, 60 : WIDTH // 2 - 10]
    assert np.median(np.abs(on_the_wall_px - true_px)) < abs(10.2 - true_px) / 2
