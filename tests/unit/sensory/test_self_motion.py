"""Self-motion by wheels, views or both, on drives along a textured street."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.schemas.sensing import Calibration, Odometry, SelfMotion
from cogmap.services.sensory.module import Config, build
from cogmap.services.sensory.self_motion.sense import Source
from cogmap.testing import of_type
from tests.support.world.stereo_street import CAMERA, Image, Pose, frame, pair

NS_PER_S = 1_000_000_000
SPEED_M_S = 6.0
SMALL = msgspec.structs.replace(
    CAMERA,
    width_px=240,
    height_px=160,
    fx_px=150.0,
    fy_px=150.0,
    cx_px=119.5,
    cy_px=79.5,
    baseline_m=0.1,
    mount_height_m=0.3,
)
FORWARD = msgspec.structs.replace(CAMERA, mount_forward_m=1.1)


def _bend(steps: int, step_m: float, turn_rad: float = 0.0) -> list[Pose]:
    """Arcs of `step_m`, each turning as much."""
    poses = [(0.0, 0.0, 0.0)]
    for _ in range(steps):
        x_m, y_m, heading_rad = poses[-1]
        chord_rad = heading_rad + turn_rad / 2
        poses.append(
            (
                x_m + step_m * math.cos(chord_rad),
                y_m + step_m * math.sin(chord_rad),
                heading_rad + turn_rad,
            )
        )
    return poses


def _drive(
    poses: list[Pose],
    source: Source,
    *,
    dt_s: float = 0.1,
    camera: Calibration = CAMERA,
    scale: float = 1.0,
    wheel_factor: float = 1.0,
    last_wheel_factor: float | None = None,
    change: dict[int, Image] | None = None,
) -> list[SelfMotion]:
    """What the module publishes on a drive, of which `change` has other left images."""
    module = build(Config(self_motion=source), "sensory")
    published = []
    for number, pose in enumerate(poses):
        stamp_ns = round((number + 1) * dt_s * NS_PER_S)
        left, right = pair(pose, camera, scale)
        images = (left, right) if not change or number not in change else (change[number],) * 2
        published += module.feed(frame(number, stamp_ns, images, camera))

        before = poses[max(0, number - 1)]
        step_m = math.hypot(pose[0] - before[0], pose[1] - before[1])
        is_last = number == len(poses) - 1
        factor = wheel_factor
        if is_last and last_wheel_factor is not None:
            factor = last_wheel_factor
        wheels = Odometry(
            stamp_ns=stamp_ns,
            speed_m_s=factor * step_m / dt_s,
            turn_rate_rad_s=(pose[2] - before[2]) / dt_s,
            dt_s=dt_s,
        )
        published += module.feed(wheels)
    return of_type(SelfMotion, published)


def _end(motions: list[SelfMotion]) -> Pose:
    x_m = y_m = heading_rad = 0.0
    for motion in motions[1:]:
        for speed_m_s, turn_rate_rad_s, dt_s, *_ in motion.motions.numpy().tolist():
            chord_rad = heading_rad + turn_rate_rad_s * dt_s / 2
            x_m += speed_m_s * dt_s * math.cos(chord_rad)
            y_m += speed_m_s * dt_s * math.sin(chord_rad)
            heading_rad += turn_rate_rad_s * dt_s
    return x_m, y_m, heading_rad


def _distances_m(motions: list[SelfMotion]) -> np.ndarray:
    """(n, 2): each motion's distance and its standard deviation."""
    totals = []
    for motion in motions[1:]:
        speed_m_s, _, dt_s, speed_sd_m_s, _ = motion.motions.numpy().T
        sd_m = np.sqrt(((speed_sd_m_s * dt_s) ** 2).sum())
        totals.append((float(speed_m_s @ dt_s), sd_m))
    return np.array(totals)


@pytest.mark.parametrize(
    ("camera", "scale", "dt_s", "turn_rad"),
    [
        (CAMERA, 1.0, 0.1, 0.0),
        (CAMERA, 1.0, 0.1, 0.02),
        (CAMERA, 1.0, 0.2, -0.03),
        (FORWARD, 1.0, 0.1, 0.02),
        (SMALL, 0.2, 0.05, 0.02),
    ],
)
def test_views_alone_measure_a_drive_with_any_camera_at_any_rate(
    camera: Calibration, scale: float, dt_s: float, turn_rad: float
) -> None:
    step_m = SPEED_M_S * dt_s * scale
    poses = _bend(round(1.4 / dt_s), step_m, turn_rad)
    motions = _drive(poses, Source.VIEWS, dt_s=dt_s, camera=camera, scale=scale)

    x_m, y_m, heading_rad = _end(motions)
    true_x_m, true_y_m, true_heading_rad = poses[-1]
    drift = math.hypot(x_m - true_x_m, y_m - true_y_m) / (step_m * (len(poses) - 1))
    assert len(motions) == len(poses)
    assert drift < 0.015
    assert heading_rad == pytest.approx(true_heading_rad, abs=0.012)


def test_a_camera_far_before_the_axle_swings_out_in_a_bend_and_that_is_measured() -> None:
    axle = _bend(18, 0.8, 0.03)
    poses = [(x + 1.1 * math.cos(turn), y + 1.1 * math.sin(turn), turn) for x, y, turn in axle]
    x_m, y_m, _ = _end(_drive(poses, Source.VIEWS))
    cross_m = poses[-1][1] - poses[0][1]

    # As arcs alone the motions would end 1.1 m times the turn, 0.59 m, beside it.
    assert x_m == pytest.approx(poses[-1][0] - poses[0][0], abs=0.15)
    assert y_m == pytest.approx(cross_m, abs=0.2)


def test_views_say_how_wrong_they_are() -> None:
    distance_m, sd_m = _distances_m(_drive(_bend(14, 0.6), Source.VIEWS)).T
    chi2 = float(np.mean(((distance_m - 0.6) / sd_m) ** 2))

    assert 0.05 < chi2 < 3.0
    assert (sd_m < 0.05).all()


def test_without_texture_the_velocity_lasts_with_a_growing_doubt() -> None:
    blank = np.full((120, 320), 128, np.uint8)
    change = dict.fromkeys(range(8, 13), blank)
    distance_m, sd_m = _distances_m(_drive(_bend(12, 0.6), Source.VIEWS, change=change)).T
    unseen_sd_m = sd_m[7:]

    assert distance_m[7:] == pytest.approx(0.6, abs=0.03)
    assert sd_m[:7].max() < 0.05 < unseen_sd_m[0]
    assert (np.diff(unseen_sd_m) > 0).all()


def test_doubt_grows_with_time_whatever_the_rate() -> None:
    speed_sds_m_s = []
    for dt_s, blanks in ((0.1, 4), (0.2, 2)):
        poses = _bend(5 + blanks, 3.0 * dt_s)
        blank = np.full((120, 320), 128, np.uint8)
        change = dict.fromkeys(range(6, 6 + blanks), blank)
        motions = _drive(poses, Source.VIEWS, dt_s=dt_s, change=change)
        _, sd_m = _distances_m(motions)[-1]
        speed_sds_m_s.append(sd_m / dt_s)

    fast, slow = speed_sds_m_s
    assert fast == pytest.approx(slow, rel=0.05)


@pytest.mark.parametrize("wheel_factor", [0.0, 0.6, 1.5])
def test_wheels_that_lie_are_doubted_by_their_disagreement_with_the_views(
    wheel_factor: float,
) -> None:
    poses = _bend(12, 0.6, 0.01)
    x_m, y_m, _ = _end(_drive(poses, Source.BOTH, wheel_factor=wheel_factor))
    by_wheels_m, _, _ = _end(_drive(poses, Source.WHEELS, wheel_factor=wheel_factor))
    true_x_m, true_y_m, _ = poses[-1]

    assert x_m == pytest.approx(true_x_m, rel=0.03)
    assert y_m == pytest.approx(true_y_m, abs=0.1)
    assert by_wheels_m == pytest.approx(wheel_factor * true_x_m, rel=0.02)


def test_wheels_that_lied_are_doubted_where_the_views_end() -> None:
    blank = np.full((120, 320), 128, np.uint8)
    poses = _bend(12, 0.6)
    honest = _drive(poses, Source.BOTH, change={12: blank})
    lying = _drive(poses, Source.BOTH, wheel_factor=1.5, change={12: blank})
    _, honest_sd_m = _distances_m(honest)[-1]
    distance_m, sd_m = _distances_m(lying)[-1]

    assert sd_m > 1.2 * honest_sd_m
    assert distance_m < 0.7  # where wheels say 0.9


def test_views_far_turned_are_not_believed_against_wheels_that_were_right_so_far() -> None:
    straight = _bend(6, 0.5)
    for turn_rad, driven_m in ((0.1, 1.0), (0.45, 0.5)):
        poses = [*straight, (4.0, 0.0, turn_rad)]
        motions = _drive(poses, Source.BOTH, dt_s=0.5, last_wheel_factor=0.5)

        rows = np.asarray(motions[-1].motions.numpy())
        assert float(rows[:, 0] @ rows[:, 2]) == pytest.approx(driven_m, abs=0.15)


def test_views_wait_for_no_odometry() -> None:
    module = build(Config(self_motion=Source.VIEWS), "sensory")
    first = module.feed(frame(0, NS_PER_S, pair((0.0, 0.0, 0.0))))
    second = module.feed(frame(1, NS_PER_S * 11 // 10, pair((0.5, 0.0, 0.0))))
    motions = of_type(SelfMotion, [*first, *second])

    assert _end(motions)[0] == pytest.approx(0.5, abs=0.02)
    assert motions[1].since_ns == motions[0].stamp_ns


def test_a_standing_robot_has_not_moved() -> None:
    poses = [(0.0, 0.0, 0.0)] * 8
    distance_m, sd_m = _distances_m(_drive(poses, Source.VIEWS)).T

    assert np.abs(distance_m).max() < 0.01
    assert sd_m[-1] < 0.02
