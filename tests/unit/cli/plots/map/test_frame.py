"""The true town in the frame of the agent's map."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.cli.launch.observer import Observer
from cogmap.cli.plots.map.frame import town_on_map
from cogmap.schemas.sensing import Building, Pose, Street, TruePose, TrueTown

NORTH_RAD = math.pi / 2


def _observer() -> Observer:
    observer = Observer()
    start = Pose(x_m=10.0, y_m=20.0, heading_rad=NORTH_RAD)
    observer.update(TruePose(stamp_ns=0, pose=start, travelled_m=0.0, progress=0.0))
    return observer


def test_x_is_ahead_of_the_start_and_y_to_its_left() -> None:
    street = Street(name="Elm Street", line_m=[(10.0, 25.0), (7.0, 20.0)], width_m=6.0)
    pose = Pose(x_m=13.0, y_m=20.0, heading_rad=0.0)
    home = Building(name="home", pose=pose, width_m=8.0, depth_m=6.0, height_m=5.0)
    town = TrueTown(seed=1, streets=[street], buildings=[home])
    moved = town_on_map(town, _observer().to_map)

    np.testing.assert_allclose(moved.streets[0].line_m, [(5.0, 0.0), (0.0, 3.0)], atol=1e-9)
    assert moved.buildings[0].pose.y_m == pytest.approx(-3.0)
    assert moved.buildings[0].pose.heading_rad == pytest.approx(-NORTH_RAD)
