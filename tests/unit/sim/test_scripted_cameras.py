"""Simulations with cameras, along a scripted trajectory."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from cogmap.errors import ConfigError
from cogmap.robot import calibration
from cogmap.runtime.module import Module
from cogmap.runtime.run import LOCKSTEP
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import (
    MotorCommand,
    Odometry,
    Percepts,
    Pose,
    StereoFrame,
    TruePose,
    TrueTown,
    View,
)
from cogmap.services import registry
from cogmap.services.sim.layout import roadside
from cogmap.services.sim.module import Config, build
from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.rendering.camera import StereoCamera
from cogmap.services.sim.trajectory import Landmark, Trajectory
from cogmap.services.sim.world import World
from cogmap.testing import of_type
from cogmap.training.rendering import towns

SILENT = Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.0)
BAKERY = Landmark(name="bakery", x_m=40.0, y_m=14.0)
CINEMA = Landmark(name="cinema", x_m=50.0, y_m=-14.0)
BENT = [(0.0, 0.0), (9.0, 0.0), (9.0, 6.0), (3.0, 12.0)]


def _trajectory(line=BENT, landmarks=(BAKERY, CINEMA)) -> Trajectory:
    return Trajectory(
        line_m=line,
        landmarks=list(landmarks),
        speed_m_s=3.0,
        sensing="cameras",
    )


def _module(line: Trajectory, **settings) -> Module:
    config = Config(trajectory=line, frame_hz=1, noise=SILENT, **settings)
    return build(config, run=LOCKSTEP)


def _ride(module: Module) -> list[list[Message]]:
    """The messages until the line ends, frame by frame."""
    assert module.start is not None

    ride = []
    messages = module.stamp(module.start())
    while messages:
        ride.append(messages)
        messages = module.feed(
            MotorCommand(
                stamp_ns=messages[-1].stamp_ns, left_wheel_rad_s=0.0, right_wheel_rad_s=0.0
            )
        )

    return ride


@pytest.fixture(scope="module")
def ride() -> list[list[Message]]:
    return _ride(_module(_trajectory(), width_px=64, height_px=64))


@pytest.fixture(scope="module", params=[True, False], ids=["EGL", "TinyRenderer"])
def far_world(request: pytest.FixtureRequest) -> Iterator[World]:
    line = [(0.0, 0.0), (3000.0, 1000.0)]
    world = World(
        roadside.along(_trajectory(line, [Landmark(name="bakery", x_m=3000.0, y_m=1014.0)]), 1),
        request.param,
    )
    yield world
    world.close()


def _percepts(ride: list[list[Message]]) -> list[Percepts]:
    """What sensory memory and perceptual associative memory make of a ride."""
    sensory = registry.build("sensory", {})
    epam = registry.build("epam", {})
    found = []
    for frame in ride:
        for measured in frame:
            if not isinstance(measured, Odometry | StereoFrame):
                continue
            for view in of_type(View, sensory.feed(measured)):
                found += of_type(Percepts, epam.feed(view))

    return found


def test_epam_recognizes_a_landmark_in_the_images_along_a_trajectory() -> None:
    straight = _trajectory(line=[(0.0, 0.0), (6.0, 0.0)])
    seen = _percepts(_ride(_module(straight)))
    assert len(seen) == 3

    (percept,) = [each for each in seen[-1].objects if each.name == "bakery"]
    range_m = math.hypot(34.0, 14.0)
    bearing_rad = math.atan2(14.0, 34.0)
    assert percept.range_m == pytest.approx(range_m, rel=0.15)
    assert percept.bearing_rad == pytest.approx(bearing_rad, abs=0.1)


def test_wheels_without_noise_add_up_to_the_line_with_its_corners(
    ride: list[list[Message]],
) -> None:
    x = y = heading = 0.0
    last_ns = 0
    for frame in ride:
        for row in of_type(Odometry, frame):
            assert row.stamp_ns > last_ns
            last_ns = row.stamp_ns

            distance_m = row.speed_m_s * row.dt_s
            x += distance_m * math.cos(heading)
            y += distance_m * math.sin(heading)
            heading += row.turn_rate_rad_s * row.dt_s

        (truth,) = of_type(TruePose, frame)
        turned_rad = math.remainder(heading - truth.pose.heading_rad, math.tau)
        assert x == pytest.approx(truth.pose.x_m, abs=1e-9)
        assert y == pytest.approx(truth.pose.y_m, abs=1e-9)
        assert turned_rad == pytest.approx(0.0, abs=1e-9)
        assert last_ns == frame[-1].stamp_ns


def test_the_first_images_are_taken_before_the_robot_moves(ride: list[list[Message]]) -> None:
    travelled = [
        message.travelled_m
        for frame in ride[:2]
        for message in frame
        if isinstance(message, TruePose)
    ]

    assert travelled == pytest.approx([0.0, 3.0])


def test_frames_end_with_their_images_and_the_last_is_at_the_lines_end(
    ride: list[list[Message]],
) -> None:
    for frame in ride:
        assert isinstance(frame[-1], StereoFrame)

    (end,) = of_type(TruePose, ride[-1])
    assert end.pose.x_m == pytest.approx(3.0)
    assert end.pose.y_m == pytest.approx(12.0)
    assert end.progress == pytest.approx(1.0)


def test_the_truth_tells_the_buildings_as_large_as_their_kinds_are(
    ride: list[list[Message]],
) -> None:
    (place,) = [message for message in ride[0] if isinstance(message, TrueTown)]

    assert [(each.name, each.width_m) for each in place.buildings] == [
        ("bakery", 9.0),
        ("cinema", 13.0),
    ]


def test_buildings_look_to_the_street() -> None:
    street = _trajectory(line=[(0.0, 0.0), (60.0, 0.0)])
    left, right = roadside.along(street, 1).plots

    assert left.kind.name == "bakery"
    assert left.heading_rad == pytest.approx(0.0)
    assert right.kind.name == "cinema"
    assert abs(right.heading_rad) == pytest.approx(math.pi)


def test_kilometres_away_there_are_ground_sky_and_the_building(
    far_world: World,
) -> None:
    heading_rad = math.atan2(1000.0, 3000.0)
    far_world.place_robot(Pose(x_m=2970.0, y_m=990.0, heading_rad=heading_rad))
    camera = StereoCamera(far_world, calibration())

    exposure, _ = camera.capture_labelled()
    surface = towns.surfaces(far_world, exposure)
    names = {towns.SURFACES[number] for number in np.unique(surface)}
    sky = surface == towns.SURFACES.index("sky")
    road = surface == towns.SURFACES.index("road")

    assert names == {"sky", "ground", "road", "building"}
    assert sky[:20].mean() > 0.9
    assert road[-20:, 140:180].all()
    assert exposure.body.min() >= 0


def test_a_landmark_that_no_building_is_called_is_refused_in_one_sentence() -> None:
    house = Landmark(name="house 3", x_m=20.0, y_m=14.0)

    with pytest.raises(
        ConfigError, match=r"^\[sim\] cameras see no 'house 3': name each landmark .*bakery"
    ) as error:
        _module(_trajectory(landmarks=[house]))
    assert "\n" not in str(error.value)


def test_a_landmark_that_would_stand_in_the_way_is_refused() -> None:
    on_the_line = Landmark(name="cinema", x_m=5.0, y_m=2.0)

    with pytest.raises(ConfigError, match=r"the cinema at \(5, 2\) would stand in the way"):
        _module(_trajectory(landmarks=[on_the_line]))
