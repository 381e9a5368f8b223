"""A robot that drives itself through a town, sensed at the level of percepts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.errors import ConfigError
from cogmap.robot import BODY_RADIUS_M, calibration
from cogmap.runtime.run import LOCKSTEP
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import (
    MotorCommand,
    Percepts,
    Pose,
    RangeScan,
    SelfMotion,
    TruePose,
    TrueTown,
)
from cogmap.services.sim.drivers.kinematic import KinematicRobot
from cogmap.services.sim.layout.blocks.town import generate
from cogmap.services.sim.layout.boundaries import clearance_m
from cogmap.services.sim.layout.catalogue import CATALOGUE
from cogmap.services.sim.layout.closures import Closure
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Plot, Road
from cogmap.services.sim.module import Config, build
from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.percept_level.column_camera import ColumnCamera, depths_m
from cogmap.services.sim.percept_level.ground import MAX_RANGE_M
from cogmap.services.sim.percept_level.percepts import PerceptErrors
from cogmap.services.sim.percept_level.surroundings import Surroundings
from cogmap.services.sim.percept_level.town_sensors import TownSensors, scan
from cogmap.testing import of_type

MOUNT = calibration()
TOWN = generate(1)
EXACT = PerceptErrors(
    detected=1.0,
    right_name=1.0,
    precision=1.0,
    range_sd_share=0.0,
    bearing_sd_rad=1e-9,
    road_edge_sd_m=0.0,
)
STREET = Road("Long Street 1", (0.0, 0.0), (60.0, 0.0), 8.0)
AT_ORIGIN = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
KINDS = {kind.name: kind for kind in CATALOGUE}
BANK = Plot(KINDS["bank"], 40.0, 0.0, -math.pi / 2)
TICK_S = 0.05


def _place(*plots: Plot) -> Place:
    return Place(seed=1, roads=(STREET,), plots=plots, props=(), start=AT_ORIGIN)


def _command(left_rad_s: float, right_rad_s: float, stamp_ns: int = 0) -> MotorCommand:
    return MotorCommand(
        stamp_ns=stamp_ns, left_wheel_rad_s=left_rad_s, right_wheel_rad_s=right_rad_s
    )


def _driven(robot: KinematicRobot, command: MotorCommand, seconds: float) -> None:
    robot.drive(command)
    for _ in range(round(seconds / TICK_S)):
        robot.advance(TICK_S)


def _poses(count: int) -> list[Pose]:
    """Poses anywhere on the streets of the town."""
    rng = np.random.default_rng(5)
    poses = []
    for _ in range(count):
        road = TOWN.roads[int(rng.integers(len(TOWN.roads)))]
        x_m, y_m = road.point(float(rng.uniform(0, road.length_m)))
        poses.append(Pose(x_m=x_m, y_m=y_m, heading_rad=float(rng.uniform(-3, 3))))

    return poses


def _first_hit_m(at_m: np.ndarray, direction: np.ndarray, segments_m: np.ndarray) -> float:
    """The nearest crossing of a ray with any segment, one by one, in lengths of `direction`."""
    nearest_m = math.inf
    for x0, y0, x1, y1 in segments_m.tolist():
        along = np.array([x1 - x0, y1 - y0])
        to_start = np.array([x0, y0]) - at_m
        divisor = direction[0] * along[1] - direction[1] * along[0]
        if divisor == 0.0:
            continue

        distance_m = (to_start[0] * along[1] - to_start[1] * along[0]) / divisor
        share = (to_start[0] * direction[1] - to_start[1] * direction[0]) / divisor
        if distance_m > 0 and 0 <= share <= 1:
            nearest_m = min(nearest_m, distance_m)

    return nearest_m


def test_the_nearest_in_each_column_is_that_of_rays_cast_one_by_one() -> None:
    camera = ColumnCamera(MOUNT)
    segments_m = TOWN.walls_m
    columns = np.arange(0, MOUNT.width_px, 40)

    for pose in _poses(6):
        at = np.array([pose.x_m, pose.y_m, pose.heading_rad])
        depth_m = depths_m(camera.nearest(at, segments_m).inverse_m)

        ahead = np.array([math.cos(pose.heading_rad), math.sin(pose.heading_rad)])
        left = np.array([-ahead[1], ahead[0]])
        camera_m = at[:2] + MOUNT.mount_forward_m * ahead
        for column in columns:
            direction = ahead + camera.left_slope[column] * left
            expected_m = _first_hit_m(camera_m, direction, segments_m)
            assert depth_m[column] == pytest.approx(expected_m, rel=1e-9)


def test_a_segment_that_passes_beside_the_camera_is_cut_off() -> None:
    camera = ColumnCamera(MOUNT)
    beside_m = np.array([[-50.0, 2.0, 50.0, 2.0]])
    depth_m = depths_m(camera.nearest(np.zeros(3), beside_m).inverse_m)

    assert depth_m[0] == pytest.approx(2.0 / camera.left_slope[0])
    assert np.isinf(depth_m[-1])


def test_the_scan_has_the_range_of_a_wall_ahead_from_the_robots_origin() -> None:
    camera = ColumnCamera(MOUNT)
    wall_m = np.array([[10.0, -30.0, 10.0, 30.0]])
    depth_m = depths_m(camera.nearest(np.zeros(3), wall_m).inverse_m)
    bearing_rad, range_m = scan(camera, depth_m)

    assert bearing_rad[0] > 0 > bearing_rad[-1]
    assert range_m * np.cos(bearing_rad) == pytest.approx(10.0, abs=0.25)


def test_the_scan_is_limited_to_the_ranges_that_stereo_matches() -> None:
    camera = ColumnCamera(MOUNT)
    for ahead_m, expected_m in ((1.0, 2.5), (2.5, 2.5), (5.0, 5.0), (70.0, 0.0)):
        wall_m = np.array([[ahead_m, -90.0, ahead_m, 90.0]])
        depth_m = depths_m(camera.nearest(np.zeros(3), wall_m).inverse_m)
        _, range_m = scan(camera, depth_m)
        assert range_m[16] == pytest.approx(expected_m, abs=0.05)


def _seen(place: Place, pose: Pose = AT_ORIGIN, errors: PerceptErrors = EXACT):
    return TownSensors(place, Surroundings(place), errors, MOUNT, seed=1).look(pose)


def test_road_and_boundary_are_where_the_street_is() -> None:
    seen = _seen(_place(), Pose(x_m=5.0, y_m=0.0, heading_rad=0.0))
    road_m = seen.road_m.astype(float)
    boundary_m = seen.boundary_m.astype(float)

    assert len(road_m) > 200
    assert np.abs(road_m[:, 1]).max() <= 4.0
    assert np.hypot(*road_m.T).max() <= MAX_RANGE_M
    assert 2.5 < road_m[:, 0].min() < 3.5

    assert len(boundary_m) > 20
    assert np.abs(boundary_m[:, 1]) == pytest.approx(4.0, abs=1e-6)
    assert (boundary_m[:, 1] > 0).any()
    assert (boundary_m[:, 1] < 0).any()


def test_what_stands_on_the_street_hides_the_road_behind_it() -> None:
    near_bank = replace(BANK, x_m=17.0)
    seen = _seen(_place(near_bank), Pose(x_m=5.0, y_m=0.0, heading_rad=0.0))
    front_m = 17.0 - KINDS["bank"].depth_m / 2 - 5.0
    is_before = np.abs(seen.road_m[:, 1]) < 2.0

    assert seen.road_m[is_before, 0].max() < front_m
    assert seen.boundary_m[:, 0].max() < front_m + 1.0


def test_a_building_behind_another_is_not_seen() -> None:
    behind = Plot(KINDS["florist"], 55.0, 0.0, -math.pi / 2)
    beside = Plot(KINDS["cafe"], 45.0, 20.0, 0.0)

    labels = [percept.name for percept in _seen(_place(BANK, behind, beside)).objects]
    assert sorted(labels) == ["bank", "cafe"]

    alone = [percept.name for percept in _seen(_place(behind)).objects]
    assert alone == ["florist"]


def test_a_building_that_another_or_the_border_cuts_is_not_whole() -> None:
    peeping = Plot(KINDS["library"], 55.0, 7.0, 0.0)
    at_border = Plot(KINDS["cafe"], 30.0, 22.0, 0.0)
    seen = _seen(_place(BANK, peeping, at_border)).objects
    whole = {percept.name: percept.whole for percept in seen}

    assert whole == {"bank": True, "library": False, "cafe": False}


def test_the_robot_reaches_the_commanded_speed_and_turns_as_its_wheels() -> None:
    robot = KinematicRobot(AT_ORIGIN, Surroundings(_place()))
    robot.drive(_command(15.0, 15.0))
    robot.advance(TICK_S)
    assert 0.0 < robot.travelled_m < 0.5 * 3.0 * TICK_S

    _driven(robot, _command(15.0, 15.0), 2.0)
    before = robot.pose
    robot.advance(TICK_S)
    assert robot.pose.x_m - before.x_m == pytest.approx(3.0 * TICK_S)

    _driven(robot, _command(-4.0, 4.0), 2.0)
    before = robot.pose
    robot.advance(TICK_S)
    turned_rad = math.remainder(robot.pose.heading_rad - before.heading_rad, math.tau)
    assert turned_rad == pytest.approx(TICK_S * 2 * 0.8 / 0.8)
    assert robot.pose.x_m == pytest.approx(before.x_m)


def test_the_robot_stops_at_a_wall_and_that_is_one_collision() -> None:
    place = _place(replace(BANK, x_m=17.0))
    robot = KinematicRobot(AT_ORIGIN, Surroundings(place))
    _driven(robot, _command(15.0, 15.0), 10.0)
    front_m = 17.0 - KINDS["bank"].depth_m / 2

    assert robot.collisions == 1
    assert front_m - BODY_RADIUS_M - 0.2 < robot.pose.x_m <= front_m - BODY_RADIUS_M

    _driven(robot, _command(-10.0, -10.0), 2.0)
    assert robot.collisions == 1
    assert robot.pose.x_m < front_m - 2.0

    _driven(robot, _command(15.0, 15.0), 10.0)
    assert robot.collisions == 2


def test_the_robot_never_enters_anything() -> None:
    surroundings = Surroundings(TOWN)
    robot = KinematicRobot(TOWN.start, surroundings)
    rng = np.random.default_rng(2)
    for _ in range(150):
        _driven(robot, _command(*rng.uniform(-10, 25, 2).tolist()), 1.0)
        pose = robot.pose
        solid_m = surroundings.near(pose.x_m, pose.y_m).solid_m
        assert clearance_m(solid_m, pose.x_m, pose.y_m) >= BODY_RADIUS_M

    assert robot.collisions > 0


def test_a_barrier_closes_a_street_until_it_is_opened() -> None:
    place = _place()
    surroundings = Surroundings(place)
    robot = KinematicRobot(AT_ORIGIN, surroundings)

    surroundings.change([STREET.name], [])
    _driven(robot, _command(15.0, 15.0), 15.0)
    assert robot.pose.x_m == pytest.approx(30.0 - 0.2 - BODY_RADIUS_M, abs=0.2)
    assert robot.collisions == 1

    sensors = TownSensors(place, surroundings, EXACT, MOUNT, seed=1)
    seen = sensors.look(Pose(x_m=20.0, y_m=0.0, heading_rad=0.0))
    assert seen.range_m[16] == pytest.approx(9.8, abs=0.2)

    surroundings.change([], [])
    _driven(robot, _command(15.0, 15.0), 5.0)
    assert robot.pose.x_m > 40.0


def _config(**changes) -> Config:
    return Config(town="blocks", sensing="percepts", duration_s=20.0, **changes)


def _drive(config: Config) -> list[Message]:
    """All that is published on a drive that turns away from what is near."""
    module = build(config, run=LOCKSTEP)
    assert module.start is not None
    messages = module.stamp(module.start())
    published = list(messages)
    while messages:
        (seen,) = of_type(RangeScan, messages)
        range_m = seen.range_m.numpy()
        is_near = ((range_m > 0) & (range_m < 6.0))[8:24].any()
        command = _command(0.0 if is_near else 12.0, 6.0 if is_near else 12.0, seen.stamp_ns)
        messages = module.feed(command)
        published += messages

    return published


def test_a_drive_ends_after_its_duration_with_a_view_for_each_command() -> None:
    published = _drive(_config())

    assert len(of_type(Percepts, published)) == len(of_type(RangeScan, published)) == 100
    truths = of_type(TruePose, published)
    assert truths[-1].progress == 1.0
    assert truths[-1].travelled_m > 10.0
    assert truths[50].progress == pytest.approx(truths[50].stamp_ns / 20e9)


def test_self_motion_without_noise_leads_to_the_true_pose() -> None:
    silent = Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.0)
    published = _drive(_config(noise=silent))

    x_m, y_m, heading_rad = TOWN.start.x_m, TOWN.start.y_m, TOWN.start.heading_rad
    for motion in of_type(SelfMotion, published):
        for speed_m_s, turn_rate, dt_s, *_ in motion.motions.numpy().tolist():
            middle_rad = heading_rad + turn_rate * dt_s / 2
            x_m += speed_m_s * dt_s * math.cos(middle_rad)
            y_m += speed_m_s * dt_s * math.sin(middle_rad)
            heading_rad += turn_rate * dt_s

    end = of_type(TruePose, published)[-1].pose
    assert x_m == pytest.approx(end.x_m, abs=1e-6)
    assert y_m == pytest.approx(end.y_m, abs=1e-6)
    assert math.remainder(heading_rad - end.heading_rad, math.tau) == pytest.approx(0.0, abs=1e-6)


def test_a_simulation_that_was_killed_continues_where_the_robot_was() -> None:
    truths = of_type(TruePose, _drive(_config()))[:40]
    module = build(_config(), run=LOCKSTEP)
    assert module.restore is not None
    assert module.start is not None
    module.restore(truths)
    again = module.stamp(module.start())

    (truth,) = of_type(TruePose, again)
    (percepts,) = of_type(Percepts, again)
    assert truth.pose == truths[-1].pose
    assert truth.stamp_ns == truths[-1].stamp_ns + 200_000_000
    assert truth.travelled_m == truths[-1].travelled_m
    assert percepts.frame == 40


def test_the_same_seed_gives_the_same_bytes() -> None:
    first = [encode(message) for message in _drive(_config(seed=2))]

    assert [encode(message) for message in _drive(_config(seed=2))] == first
    assert [encode(message) for message in _drive(_config(seed=3))] != first


def test_a_street_is_closed_and_opened_by_schedule() -> None:
    name = TOWN.roads[0].name
    closure = Closure(street=name, from_s=5.0, to_s=12.0)
    towns = of_type(TrueTown, _drive(_config(closures=[closure])))

    assert [town.stamp_ns / 1e9 for town in towns] == pytest.approx([0.0, 5.0, 12.0])
    closed = [[street.name for street in town.streets if street.closed] for town in towns]
    assert closed == [[], [name], []]


def test_a_closure_of_a_street_that_is_not_there_is_refused() -> None:
    closure = Closure(street="Nowhere 1", from_s=0.0)

    with pytest.raises(ConfigError, match=r"'Nowhere 1'.*name one of"):
        build(_config(closures=[closure]), run=LOCKSTEP)


def test_a_closure_of_a_street_that_was_misspelt_names_the_one_that_was_meant() -> None:
    name = TOWN.roads[0].name
    closure = Closure(street=name.lower(), from_s=0.0)

    with pytest.raises(ConfigError, match=f"did you mean {name!r}"):
        build(_config(closures=[closure]), run=LOCKSTEP)


@pytest.mark.parametrize("town", ["village", "osm:", ""])
def test_a_town_that_there_is_none_of_is_refused(town: str) -> None:
    with pytest.raises(ConfigError, match=r"choose loop, blocks, osm:FILE.*or FILE\.toml"):
        build(Config(town=town))
