"""Towns of several blocks, and from OpenStreetMap, in pybullet."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from cogmap.schemas.sensing import MotorCommand, Odometry, Pose, StreetClosure, TrueTown
from cogmap.services.sim.camera_level import CameraSenses, driven
from cogmap.services.sim.config import Config
from cogmap.services.sim.layout.blocks.town import generate
from cogmap.services.sim.layout.catalogue import BuildingType
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Plot, Road
from cogmap.services.sim.scene.nearby import ADDED_M, HIDDEN_M, Nearby, Piece
from cogmap.services.sim.stdio import pybullet
from cogmap.services.sim.world import World

TOWN = generate(1, 150.0)
START = TOWN.start
STREET = Road("Long Street 1", (0.0, 0.0), (60.0, 0.0), 8.0)
AT_ORIGIN = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
TICK_S = 0.05


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    world = World(TOWN, want_egl=False, whole=False)
    yield world
    world.close()


def _kind(width_m: float, depth_m: float) -> BuildingType:
    colour = (120, 130, 140)
    return BuildingType(
        name="block",
        width_m=width_m,
        depth_m=depth_m,
        height_m=6.0,
        wall=colour,
        accent=colour,
        trim=colour,
        door=colour,
        roof=colour,
        pattern="",
    )


def _place(*plots: Plot) -> Place:
    return Place(seed=1, roads=(STREET,), plots=plots, props=(), start=AT_ORIGIN)


def _drive(world: World, seconds: float, wheels_rad_s: float = 15.0) -> Pose:
    world.robot.drive(wheels_rad_s, wheels_rad_s)
    for _ in range(round(seconds / TICK_S)):
        world.step(TICK_S)

    return world.pose()


def _names_there(world: World) -> set[str]:
    """The buildings that stand on the ground."""
    names = set()
    for body, name in world.building_of_body.items():
        (_, _, z_m), _ = pybullet.getBasePositionAndOrientation(body, physicsClientId=world.client)
        if z_m == 0.0:
            names.add(name)

    return names


def _near_names(place: Place, pose: Pose, reach_m: float) -> set[str]:
    """The buildings that come within reach of a pose."""
    names = set()
    for plot in place.plots:
        half_m = math.hypot(plot.kind.width_m, plot.kind.depth_m) / 2
        if math.hypot(plot.x_m - pose.x_m, plot.y_m - pose.y_m) - half_m <= reach_m:
            names.add(plot.kind.name)

    return names


def test_only_what_is_near_the_robot_is_there(world: World) -> None:
    for x_m, y_m in ((START.x_m, START.y_m), (-70.0, -70.0), (70.0, 60.0)):
        pose = Pose(x_m=x_m, y_m=y_m, heading_rad=0.0)
        world.place_robot(pose)
        there = _names_there(world)

        assert _near_names(TOWN, pose, ADDED_M) <= there
        assert there <= _near_names(TOWN, pose, HIDDEN_M)
        assert len(there) < len(TOWN.plots)


def test_a_barrier_stops_the_robot_until_the_street_is_opened() -> None:
    world = World(_place(), want_egl=False, whole=False)
    world.close_streets(frozenset({STREET.name}))
    stopped = _drive(world, 14.0)
    assert 28.0 < stopped.x_m < 30.0
    assert world.collisions == 1

    world.close_streets(frozenset())
    assert _drive(world, 4.0).x_m > 35.0
    assert world.collisions == 1
    world.close()


def test_a_building_of_any_outline_stops_the_robot() -> None:
    corner = ((12.0, -4.0), (20.0, -4.0), (20.0, 6.0), (16.0, 6.0), (16.0, 2.0), (12.0, 2.0))
    plot = Plot(_kind(8.0, 10.0), 16.0, 1.0, 0.0, outline=corner)
    world = World(_place(plot), want_egl=False, whole=False)
    stopped = _drive(world, 8.0)
    world.close()

    assert 10.5 < stopped.x_m < 12.0
    assert world.collisions == 1


def test_pieces_come_and_go_as_the_robot_moves() -> None:
    there: set[int] = set()
    built: list[int] = []

    def piece(number: int) -> Piece:
        def add() -> list[int]:
            there.add(number)
            built.append(number)
            return [number]

        return Piece((10.0 * number, 0.0), 0.0, add)

    nearby = Nearby([piece(number) for number in range(60)], there.discard, there.add)
    nearby.update(0.0, 0.0)
    assert there == set(range(9))

    there_and_back_m = [*np.arange(0.0, 400.0, 2.5), *np.arange(400.0, 0.0, -2.5)]
    for x_m in there_and_back_m:
        nearby.update(x_m, 0.0)
        wanted = {number for number in range(60) if abs(10.0 * number - x_m) <= ADDED_M - 2.5}
        most = {number for number in range(60) if abs(10.0 * number - x_m) <= HIDDEN_M + 2.5}
        assert wanted <= there <= most

    assert len(built) == len(set(built))


def test_a_town_of_blocks_ends_by_time_and_publishes_what_closes() -> None:
    away_m = [math.dist(road.middle, (START.x_m, START.y_m)) for road in TOWN.roads]
    name = TOWN.roads[int(np.argmax(away_m))].name
    config = Config(town="blocks", town_size_m=150.0, duration_s=2.0, egl=False, width_px=64)
    simulation = driven(config, None, ticks_per_frame=4)
    simulation.drive(MotorCommand(left_wheel_rad_s=10.0, right_wheel_rad_s=10.0))
    assert simulation.changed_town() == []

    simulation.closed_streets.on_closure(StreetClosure(street=name, closed=True))
    (changed,) = simulation.changed_town()
    assert isinstance(changed, TrueTown)
    assert [street.name for street in changed.streets if street.closed] == [name]
    assert simulation.changed_town() == []

    for _ in range(40):
        (measured,) = simulation.step()
        assert isinstance(measured, Odometry)
    truth = simulation.truth()
    assert isinstance(simulation.senses, CameraSenses)
    simulation.senses.world.close()

    assert truth.progress == 1.0
    assert truth.travelled_m > 1.0
    assert truth.collisions == 0
