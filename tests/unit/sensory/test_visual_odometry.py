"""Self-motion from what is seen, on a wall of random texture with known motion."""

from __future__ import annotations

import cv2
import msgspec
import numpy as np
import pytest

from cogmap.schemas.sensing import Calibration
from cogmap.services.sensory.disparity import DepthFromStereo
from cogmap.services.sensory.self_motion.motion import Motion, Velocity
from cogmap.services.sensory.self_motion.tracks import corners
from cogmap.services.sensory.self_motion.visual_odometry import TrackedView, VisualOdometry
from cogmap.services.sensory.self_motion.wheels import WheelNoise, fuse, spread
from tests.support.world.stereo_street import CAMERA as STREET_CAMERA
from tests.support.world.stereo_street import pair

CAMERA = Calibration(
    width_px=320,
    height_px=240,
    fx_px=208.0,
    fy_px=208.0,
    cx_px=159.5,
    cy_px=119.5,
    baseline_m=0.5,
    mount_height_m=1.5,
)
WALL_M = 12.0
PX_PER_M = 50


def _view(distance_m: float, turn_rad: float) -> TrackedView:
    """A wall at WALL_M seen after a distance ahead and a turn to the left."""
    column, row = np.meshgrid(np.arange(320.0), np.arange(240.0))
    right = (column - CAMERA.cx_px) / CAMERA.fx_px
    down = (row - CAMERA.cy_px) / CAMERA.fy_px

    cos = np.cos(turn_rad)
    sin = np.sin(turn_rad)
    depth_m = (WALL_M - distance_m) / (cos + right * sin)
    across_m = (right * cos - sin) * depth_m
    down_m = down * depth_m

    x_px = (1000 + PX_PER_M * across_m).astype(np.float32)
    y_px = (1000 + PX_PER_M * down_m).astype(np.float32)
    grey = cv2.remap(_texture(), x_px, y_px, cv2.INTER_LINEAR)
    disparity_px = (CAMERA.fx_px * CAMERA.baseline_m / depth_m).astype(np.float32)
    return TrackedView(grey, disparity_px, corners(grey), CAMERA)


def _texture() -> np.ndarray:
    rng = np.random.default_rng(7)
    noise = rng.integers(0, 255, (2000, 2000), np.uint8)
    smooth = cv2.GaussianBlur(noise, (0, 0), 6)
    return cv2.normalize(smooth, None, 0, 255, cv2.NORM_MINMAX)


@pytest.mark.parametrize(
    ("distance_m", "turn_rad"), [(0.6, 0.0), (0.5, 0.1), (0.0, -0.3), (2.0, 0.02)]
)
def test_two_views_measure_distance_and_turn_with_nothing_else(
    distance_m: float, turn_rad: float
) -> None:
    odometry = VisualOdometry(has_wheels=False)
    nothing = Velocity().over(0.2)
    still = Motion(0.0, 0.0, 0.0, 0.0)
    odometry.update(_view(0.0, 0.0), nothing, 0.2, [still])
    motion = odometry.update(_view(distance_m, turn_rad), nothing, 0.2, [still])

    assert motion is not None
    assert motion.turn_rad == pytest.approx(turn_rad, abs=0.003)
    assert motion.distance_m == pytest.approx(distance_m, abs=0.03)
    assert abs(motion.turn_rad - turn_rad) < 4 * motion.turn_sd_rad
    assert abs(motion.distance_m - distance_m) < 4 * motion.distance_sd_m


@pytest.mark.parametrize("period_rows", [1e9, 40.0])
def test_another_exposure_or_one_that_rolls_changes_no_motion(period_rows: float) -> None:
    rows = np.arange(240)[:, None]
    brightness = 1 + 0.3 * np.cos(rows / period_rows)
    after = _view(0.6, 0.05)
    brighter = np.clip(after.grey * brightness * 0.8, 0, 255).astype(np.uint8)
    odometry = VisualOdometry(has_wheels=False)
    nothing = Velocity().over(0.2)
    odometry.update(_view(0.0, 0.0), nothing, 0.2, [nothing])
    motion = odometry.update(after._replace(grey=brighter), nothing, 0.2, [nothing])

    assert motion is not None
    assert motion.turn_rad == pytest.approx(0.05, abs=0.004)
    assert motion.distance_m == pytest.approx(0.6, abs=0.04)


def test_the_way_shows_how_the_camera_is_tilted() -> None:
    odometry = VisualOdometry(has_wheels=False)
    step = Velocity(6.0, 0.0, 1.0, 0.1).over(0.1)
    tilted = msgspec.structs.replace(STREET_CAMERA, cy_px=STREET_CAMERA.cy_px + 6.0)
    depth = DepthFromStereo(tilted)
    for number in range(6):
        left, right = pair((0.6 * number, 0.0, 0.0), STREET_CAMERA)
        colours = [cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB) for grey in (left, right)]
        view = TrackedView(left, depth.disparity_px(*colours), corners(left), tilted)
        odometry.update(view, step, 0.1, [step])

    # The image's middle row is taken for 6 px lower than it is.
    assert odometry.slope.mean == pytest.approx(-6.0 / 200.0, abs=0.008)


def test_without_texture_views_measure_nothing() -> None:
    blank = np.full((240, 320), 90, np.uint8)
    disparity_px = np.full((240, 320), 9.0, np.float32)
    view = TrackedView(blank, disparity_px, corners(blank), CAMERA)
    odometry = VisualOdometry(has_wheels=False)
    nothing = Velocity().over(0.2)
    odometry.update(view, nothing, 0.2, [nothing])

    assert odometry.update(view, nothing, 0.2, [nothing]) is None


def test_a_motion_of_views_alone_leads_where_they_saw_it_lead() -> None:
    motion = Motion(1.0, 0.2, 0.01, 0.002, drift_rad=0.05)
    x_m = y_m = heading_rad = 0.0
    for speed_m_s, turn_rate_rad_s, dt_s, *_ in spread(motion, 0.1).tolist():
        chord_rad = heading_rad + turn_rate_rad_s * dt_s / 2
        x_m += speed_m_s * dt_s * np.cos(chord_rad)
        y_m += speed_m_s * dt_s * np.sin(chord_rad)
        heading_rad += turn_rate_rad_s * dt_s

    assert heading_rad == pytest.approx(0.2)
    assert np.hypot(x_m, y_m) == pytest.approx(1.0)
    assert np.arctan2(y_m, x_m) == pytest.approx(0.15)


def test_fused_rows_add_up_to_the_fused_motion_and_its_spread():
    rows = np.array([[2.0, 0.1, 0.05], [2.2, 0.3, 0.05], [2.4, 0.2, 0.05]])
    wheels = WheelNoise(0.1, 0.1, 0.02).total(rows)
    fused = fuse(rows, Motion(0.3, 0.05, 0.01, 0.002), wheels)
    speed_m_s, turn_rate_rad_s, duration_s, _, turn_rate_sd_rad_s = fused.T
    turn_variance_rad2 = ((turn_rate_sd_rad_s * duration_s) ** 2).sum()

    assert (speed_m_s * duration_s).sum() == pytest.approx(0.3)
    assert (turn_rate_rad_s * duration_s).sum() == pytest.approx(0.05)
    assert np.sqrt(turn_variance_rad2) == pytest.approx(0.002)


def test_wheels_that_stand_still_have_no_noise():
    still_rows = np.array([[0.0, 0.0, 0.05]] * 4)
    still = WheelNoise(0.1, 0.1, 0.02).total(still_rows)

    assert still.distance_sd_m == 0.0
    assert still.turn_sd_rad == 0.0
