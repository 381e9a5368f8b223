"""Streets without houses that a robot drives on."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.errors import ConfigError
from cogmap.runtime.run import LOCKSTEP
from cogmap.schemas.sensing import MotorCommand, Percepts, RangeScan
from cogmap.services.sim.layout.network import StreetNetwork
from cogmap.services.sim.module import Config, build, on_streets
from cogmap.services.sim.percept_level.percepts import PerceptErrors
from cogmap.services.sim.simulation import Simulation
from cogmap.services.sim.trajectory import Landmark, Trajectory
from cogmap.testing import of_type

EXACT = PerceptErrors(
    detected=1.0,
    right_name=1.0,
    precision=1.0,
    range_sd_share=0.0,
    bearing_sd_rad=1e-9,
    road_edge_sd_m=0.0,
    field_of_view_rad=np.pi,
)
# A street along x, and one across it 40 m ahead.
CROSS = [(0.0, 0.0, 80.0, 0.0), (40.0, -60.0, 40.0, 60.0)]
BESIDE = Landmark(name="bank", x_m=25.0, y_m=14.0)
ROUND_THE_CORNER = Landmark(name="church", x_m=26.0, y_m=40.0)


def _simulation(start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Simulation:
    network = StreetNetwork(pieces_m=CROSS, landmarks=[BESIDE, ROUND_THE_CORNER], start=start)
    config = Config(frame_hz=2, sensing="percepts", percepts=EXACT, streets=network)
    return on_streets(config, network)


def _percepts(simulation: Simulation) -> Percepts:
    (percepts,) = of_type(Percepts, simulation.view())
    return percepts


def test_the_robot_goes_where_its_wheels_are_commanded_to() -> None:
    simulation = _simulation()
    simulation.drive(MotorCommand(left_wheel_rad_s=5.0, right_wheel_rad_s=10.0))
    for _ in range(4):
        simulation.step()

    pose = simulation.truth().pose
    assert pose.x_m > 0.5
    assert pose.heading_rad > 0.5
    assert simulation.truth().progress < 1.0


def test_the_surface_of_both_streets_is_seen_and_nothing_that_stands() -> None:
    simulation = _simulation((34.0, 0.0, 0.0))
    view = simulation.view()

    (percepts,) = of_type(Percepts, view)
    (scan,) = of_type(RangeScan, view)
    x_m, y_m = percepts.road_m.numpy().T
    assert scan.range_m.shape == (0,)
    assert percepts.road_boundary_m.shape == (0, 2)
    # 40 m is 6 m ahead: the street across is wider than the one along.
    is_on_crossing = np.abs(x_m - 6.0) <= 4.0
    assert np.abs(y_m[~is_on_crossing]).max() <= 4.5
    assert np.abs(y_m[is_on_crossing]).max() > 4.5


def test_a_landmark_is_seen_along_streets_and_not_through_houses() -> None:
    along = [each.name for each in _percepts(_simulation()).objects]
    at_the_corner = [each.name for each in _percepts(_simulation((40.0, 0.0, 1.5))).objects]

    assert along == ["bank"]
    assert "church" in at_the_corner


def test_the_town_has_the_streets_and_the_landmarks() -> None:
    town = _simulation().town()

    assert [street.width_m for street in town.streets] == [8.0, 8.0]
    assert [building.name for building in town.buildings] == ["bank", "church"]


def test_streets_without_houses_take_percepts_and_no_trajectory() -> None:
    network = StreetNetwork(pieces_m=CROSS, landmarks=[], start=(0.0, 0.0, 0.0))
    line = Trajectory(line_m=[(0.0, 0.0), (10.0, 0.0)], landmarks=[])

    with pytest.raises(ConfigError, match="sensed by percepts"):
        build(Config(streets=network), run=LOCKSTEP)
    with pytest.raises(ConfigError, match="no trajectory"):
        build(Config(streets=network, sensing="percepts", trajectory=line), run=LOCKSTEP)
