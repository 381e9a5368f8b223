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
from schemas.sensing import Pose
from services.sim.layout import town
from services.sim.rendering.camera import StereoCamera, calibration
from services.sim.robot import TRACK_M, WHEEL_RADIUS_M
from services.sim.world import World
from training.rendering import towns

OPEN_FIELD = Pose(x_m=90.0, y_m=90.0, heading_rad=0.3)


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


@pytest.mark.parametrize("wheels_rad_s", [5.0, 20.0, 25.0])
def test_equal_wheels_drive_straight_at_the_commanded_speed(
    world: World, wheels_rad_s: float
) -> None:
    before, after = _drive(world, wheels_rad_s, wheels_rad_s)
    distance_m = math.hypot(after.x_m - before.x_m, after.y_m - before.y_m)

    assert distance_m == pytest.approx(wheels_rad_s * WHEEL_RADIUS_M, rel=0.01)
    assert after.heading_rad == pytest.approx(OPEN_FIELD.heading_rad, abs=0.01)


@pytest.mark.parametrize("wheels_rad_s", [(2.0, 4.0), (10.0, 14.0), (14.0, 10.0)])
def test_unequal_wheels_turn_as_a_differential_drive_does(
    world: World, wheels_rad_s: tuple[float, float]
) -> None:
    before, after = _drive(world, *wheels_rad_s)
    rate = (wheels_rad_s[1] - wheels_rad_s[0]) * WHEEL_RADIUS_M / TRACK_M

    assert math.remainder(after.heading_rad - before.heading_rad, math.tau) == pytest.approx(
        rate, rel=0.03
    )


def test_a_robot_without_a_command_stays_where_it_is(world: World) -> None:
    before, after = _drive(world, 0.0, 0.0)

    assert math.hypot(after.x_m - before.x_m, after.y_m - before.y_m) < 1e-3


def test_a_building_stops_the_robot(world: World) -> None:
    plot = world.town.plots[0]
    away_m = plot.kind.depth_m / 2 + 3.0
    toward = plot.heading_rad + math.pi / 2
    x = plot.x_m - away_m * math.cos(toward)
    y = plot.y_m - away_m * math.sin(toward)
    world.robot.place(Pose(x_m=x, y_m=y, heading_rad=toward))
    world.robot.drive(10.0, 10.0)
    world.step(4.0)
    pose = world.pose()

    assert 1.5 < math.hypot(pose.x_m - x, pose.y_m - y) < 3.2


def test_a_known_building_stands_in_both_pictures_where_geometry_puts_it(world: World) -> None:
    camera = StereoCamera(world, calibration())
    plot = min(world.town.plots, key=lambda plot: plot.kind.width_m)
    away_m = plot.kind.depth_m / 2 + 9.0
    toward = plot.heading_rad + math.pi / 2
    pose = Pose(
        x_m=plot.x_m - away_m * math.cos(toward),
        y_m=plot.y_m - away_m * math.sin(toward),
        heading_rad=toward,
    )
    world.robot.place(pose)
    exposures = camera.capture_labelled()
    eye = camera.calibration
    distance_m = 9.0 - eye.mount_forward_m
    half_m = plot.kind.width_m / 2
    turn, _ = cv2.Rodrigues(np.asarray(eye.right_rotation_rad))
    corners = np.array(
        [(-half_m, eye.mount_height_m, distance_m), (half_m, eye.mount_height_m, distance_m)]
    )
    disparities = []
    for exposure, seen in zip(
        exposures, (corners, (corners - (eye.baseline_m, 0, 0)) @ turn), strict=True
    ):
        columns = eye.fx_px * seen[:, 0] / seen[:, 2] + eye.cx_px
        rows = eye.fy_px * seen[:, 1] / seen[:, 2] + eye.cy_px
        facing = towns.labels(world, exposure) == 1 + world.town.plots.index(plot)
        on_foot = np.flatnonzero(facing[round(rows.mean()) - 4])

        assert on_foot.min() == pytest.approx(columns[0], abs=1.5)
        assert on_foot.max() == pytest.approx(columns[1], abs=1.5)

        disparities.append(on_foot.mean())

    assert exposures[0].depth_m[120, 160] == pytest.approx(distance_m, abs=0.02)
    assert disparities[0] - disparities[1] > 0.5 * eye.fx_px * eye.baseline_m / distance_m


def test_the_same_view_gives_the_same_pictures(world: World) -> None:
    camera = StereoCamera(world, calibration())
    world.robot.place(world.town.start)
    first = [picture.tobytes() for picture in camera.capture()]

    assert [picture.tobytes() for picture in camera.capture()] == first
    assert first[0] != first[1]


def test_a_second_world_rendered_by_egl_is_refused_while_one_is_open(world: World) -> None:
    if world.egl is None:
        pytest.skip("EGL does not work here")

    with pytest.raises(CogmapError, match="close it"):
        World(world.town)


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


def test_tiny_renderer_draws_the_same_town(world: World) -> None:
    world.robot.place(world.town.start)
    here = StereoCamera(world, calibration()).capture()[0].astype(float)
    plain = World(world.town, want_egl=False)
    there = StereoCamera(plain, calibration()).capture()[0].astype(float)
    plain.close()

    assert plain.egl is None
    assert np.corrcoef(cv2.blur(here, (9, 9)).ravel(), cv2.blur(there, (9, 9)).ravel())[0, 1] > 0.9


def test_no_file_is_left_of_building_a_world(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    World(town.generate(2), want_egl=False).close()

    assert not list(tmp_path.iterdir())
