"""The physical world: wheels, buildings that stop the robot, and its pictures."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from cogmap.errors import CogmapError
from cogmap.robot import TRACK_M, WHEEL_RADIUS_M, calibration
from cogmap.schemas.sensing import Calibration, Pose
from cogmap.services.sim.layout import town
from cogmap.services.sim.layout.plan import Plot
from cogmap.services.sim.rendering import shadow_map
from cogmap.services.sim.rendering.camera import Exposure, StereoCamera
from cogmap.services.sim.world import World
from cogmap.training.rendering import towns

OPEN_FIELD = Pose(x_m=90.0, y_m=90.0, heading_rad=0.3)
FRONT_AHEAD_M = 9.0


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    world = World(replace(town.generate(1), props=()))
    yield world
    world.close()


def _drive(world: World, left_rad_s: float, right_rad_s: float) -> tuple[Pose, Pose]:
    """Poses a second apart, after the robot has come up to speed."""
    world.robot.place(OPEN_FIELD)
    world.robot.drive(left_rad_s, right_rad_s)
    world.step(1.5)
    before = world.pose()
    world.step(1.0)

    return before, world.pose()


def _distance_m(one: Pose, other: Pose) -> float:
    x_m = other.x_m - one.x_m
    y_m = other.y_m - one.y_m
    return math.hypot(x_m, y_m)


def _before(plot: Plot, distance_m: float) -> Pose:
    """The pose at a distance from the front of a building, looking at it."""
    away_m = plot.kind.depth_m / 2 + distance_m
    toward = plot.heading_rad + math.pi / 2
    x_m = plot.x_m - away_m * math.cos(toward)
    y_m = plot.y_m - away_m * math.sin(toward)
    return Pose(x_m=x_m, y_m=y_m, heading_rad=toward)


@pytest.mark.parametrize("wheels_rad_s", [5.0, 20.0, 25.0])
def test_equal_wheels_drive_straight_at_the_commanded_speed(
    world: World, wheels_rad_s: float
) -> None:
    before, after = _drive(world, wheels_rad_s, wheels_rad_s)
    expected_m = wheels_rad_s * WHEEL_RADIUS_M

    assert _distance_m(before, after) == pytest.approx(expected_m, rel=0.01)
    assert after.heading_rad == pytest.approx(OPEN_FIELD.heading_rad, abs=0.01)


@pytest.mark.parametrize("wheels_rad_s", [(2.0, 4.0), (10.0, 14.0), (14.0, 10.0)])
def test_unequal_wheels_turn_as_a_differential_drive_does(
    world: World, wheels_rad_s: tuple[float, float]
) -> None:
    left_rad_s, right_rad_s = wheels_rad_s
    before, after = _drive(world, left_rad_s, right_rad_s)
    expected_rad = (right_rad_s - left_rad_s) * WHEEL_RADIUS_M / TRACK_M
    turned_rad = math.remainder(after.heading_rad - before.heading_rad, math.tau)

    assert turned_rad == pytest.approx(expected_rad, rel=0.03)


def test_a_robot_without_a_command_stays_where_it_is(world: World) -> None:
    before, after = _drive(world, 0.0, 0.0)

    assert _distance_m(before, after) < 1e-3


def test_a_building_stops_the_robot(world: World) -> None:
    start = _before(world.town.plots[0], 3.0)
    world.robot.place(start)
    world.robot.drive(10.0, 10.0)
    world.step(4.0)

    assert 1.5 < _distance_m(start, world.pose()) < 3.2


def _lower_corners_m(plot: Plot, eye: Calibration) -> tuple[np.ndarray, np.ndarray]:
    """Where the front of a building ahead meets the ground, left and right, (2, 3) as the left
    camera sees it and (2, 3) as the right one does.
    """
    half_m = plot.kind.width_m / 2
    distance_m = FRONT_AHEAD_M - eye.mount_forward_m
    corners = [(-half_m, eye.mount_height_m, distance_m), (half_m, eye.mount_height_m, distance_m)]
    by_left = np.array(corners)

    turn, _ = cv2.Rodrigues(np.asarray(eye.right_rotation_rad))
    by_right = (by_left - (eye.baseline_m, 0, 0)) @ turn
    return by_left, by_right


def _columns_of(world: World, plot: Plot, exposure: Exposure, row: int) -> np.ndarray:
    """The columns of a row of the picture that show a building."""
    number = 1 + world.town.plots.index(plot)
    shown = towns.labels(world, exposure) == number
    return np.flatnonzero(shown[row])


def _projected(eye: Calibration, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The columns and the rows of points (right, down, ahead) in a picture."""
    right, down, ahead = points_m.T
    columns = eye.fx_px * right / ahead + eye.cx_px
    rows = eye.fy_px * down / ahead + eye.cy_px
    return columns, rows


def test_a_known_building_stands_in_both_pictures_where_geometry_puts_it(world: World) -> None:
    camera = StereoCamera(world, calibration())
    eye = camera.calibration
    plot = min(world.town.plots, key=lambda plot: plot.kind.width_m)
    world.robot.place(_before(plot, FRONT_AHEAD_M))
    exposures = camera.capture_labelled()

    middles_px = []
    for exposure, corners_m in zip(exposures, _lower_corners_m(plot, eye), strict=True):
        (left_px, right_px), rows = _projected(eye, corners_m)
        shown = _columns_of(world, plot, exposure, round(rows.mean()) - 4)

        assert shown.min() == pytest.approx(left_px, abs=1.5)
        assert shown.max() == pytest.approx(right_px, abs=1.5)
        middles_px.append(shown.mean())

    distance_m = FRONT_AHEAD_M - eye.mount_forward_m
    disparity_px = middles_px[0] - middles_px[1]
    assert exposures[0].depth_m[120, 160] == pytest.approx(distance_m, abs=0.02)
    assert disparity_px > 0.5 * eye.fx_px * eye.baseline_m / distance_m


def test_the_same_view_gives_the_same_pictures(world: World) -> None:
    camera = StereoCamera(world, calibration())
    world.robot.place(world.town.start)

    first = [picture.tobytes() for picture in camera.capture()]
    again = [picture.tobytes() for picture in camera.capture()]
    left, right = first

    assert again == first
    assert left != right


def test_a_second_world_rendered_by_egl_is_refused_while_one_is_open(world: World) -> None:
    if world.egl is None:
        pytest.skip("EGL does not work here")

    with pytest.raises(CogmapError, match="close it"):
        World(world.town)


def test_the_plugin_has_one_shadow_map_which_is_shrunk(world: World) -> None:
    if world.egl is None:
        pytest.skip("EGL does not work here")
    StereoCamera(world, calibration())

    assert shadow_map.shrink() == 1


def test_pictures_asked_for_on_another_thread_are_refused(world: World) -> None:
    if world.egl is None:
        pytest.skip("EGL does not work here")
    camera = StereoCamera(world, calibration())
    caught = []

    def shoot() -> None:
        with pytest.raises(CogmapError, match="thread") as refusal:
            camera.capture()
        caught.append(refusal)

    thread = threading.Thread(target=shoot)
    thread.start()
    thread.join()

    assert caught


def _image(world: World) -> np.ndarray:
    """The left picture from where the robot is, its finest detail removed."""
    picture = StereoCamera(world, calibration()).capture()[0]
    return cv2.blur(picture.astype(float), (9, 9))


def test_tiny_renderer_draws_the_same_town(world: World) -> None:
    world.robot.place(world.town.start)
    here = _image(world)

    plain = World(world.town, want_egl=False)
    there = _image(plain)
    plain.close()

    assert plain.egl is None
    assert np.corrcoef(here.ravel(), there.ravel())[0, 1] > 0.9


def test_no_file_is_left_of_building_a_world(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    World(town.generate(2), want_egl=False).close()

    assert not list(tmp_path.iterdir())
