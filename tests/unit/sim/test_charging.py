"""Charging places stand beside the streets of a town, and are seen as buildings are."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.errors import ConfigError
from cogmap.robot import calibration
from cogmap.schemas.sensing import Percept, Pose, TrueTown
from cogmap.services.sim.layout import towns
from cogmap.services.sim.layout.boundaries import clearance_m, surfaces
from cogmap.services.sim.layout.catalogue import CATALOGUE
from cogmap.services.sim.layout.charging import with_charging_places
from cogmap.services.sim.layout.furniture import CHARGING_PLACE, Prop
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Plot, Road
from cogmap.services.sim.percept_level.percepts import PerceptErrors
from cogmap.services.sim.percept_level.surroundings import Surroundings
from cogmap.services.sim.percept_level.town_sensors import TownSensors

COUNT = 3
NEAR_M = 5.0
MOUNT = calibration()
EXACT = PerceptErrors(
    detected=1.0,
    right_name=1.0,
    precision=1.0,
    range_sd_share=0.0,
    bearing_sd_rad=1e-9,
    road_edge_sd_m=0.0,
)
AT_ORIGIN = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
STREET = Road("Long Street 1", (0.0, 0.0), (60.0, 0.0), 8.0)
POST = Prop(CHARGING_PLACE, 20.0, 5.0, 0.0, (0.6, 0.6, 2.6), 0)


@pytest.fixture(scope="module", params=[("blocks", 1), ("blocks", 2), ("blocks", 3), ("loop", 1)])
def place(request: pytest.FixtureRequest) -> Place:
    town, seed = request.param
    return towns.place(town, seed, 200.0, charging_places=COUNT)


def test_charging_places_stand_at_kerbs_and_clear_of_all_else(place: Place) -> None:
    assert len(place.charging_places) == COUNT
    others = [prop for prop in place.props if prop.kind != CHARGING_PLACE]
    streets = surfaces(place.roads)

    for post in place.charging_places:
        here_m = (post.x_m, post.y_m)
        along_m, left_m = streets.local(np.array([here_m]))
        is_along = np.abs(along_m) < streets.half_length_m
        is_on_street = is_along & (np.abs(left_m) < streets.half_width_m)

        assert not is_on_street.any()
        assert clearance_m(place.kerbs_m, *here_m) < 0.5
        assert clearance_m(place.walls_m, *here_m) >= 1.0
        assert min(math.dist(here_m, (prop.x_m, prop.y_m)) for prop in others) > 3.0


def test_a_robot_in_the_middle_of_the_street_can_come_near_enough(place: Place) -> None:
    lines = [(*road.start, *road.end) for road in place.roads]
    centre_lines_m = np.array(lines)

    for post in place.charging_places:
        apart_m = clearance_m(centre_lines_m, post.x_m, post.y_m)
        half_width_m = max(road.width_m for road in place.roads) / 2
        assert apart_m <= half_width_m + 1.0


def test_the_same_seed_gives_the_same_charging_places() -> None:
    first = towns.place("blocks", 4, 200.0, charging_places=COUNT)
    again = towns.place("blocks", 4, 200.0, charging_places=COUNT)
    bare = towns.place("blocks", 4, 200.0)

    assert first.charging_places == again.charging_places
    assert first.props[: len(bare.props)] == bare.props
    assert bare.charging_places == []


def test_charging_places_are_far_from_one_another(place: Place) -> None:
    one, other, third = place.charging_places_m

    assert min(math.dist(one, other), math.dist(other, third), math.dist(one, third)) >= 15.0


def test_a_town_without_room_for_charging_places_is_refused() -> None:
    short = Road("Short Street 1", (0.0, 0.0), (10.0, 0.0), 8.0)
    full = Place(seed=1, roads=(short,), plots=(), props=(), start=AT_ORIGIN)

    with pytest.raises(ConfigError, match="no room for 2 charging places"):
        with_charging_places(full, 1, 2)


def test_the_true_town_lists_the_charging_places(place: Place) -> None:
    town: TrueTown = place.message()

    listed = [item for item in town.obstacles if item.kind == CHARGING_PLACE]
    assert [(item.pose.x_m, item.pose.y_m) for item in listed] == place.charging_places_m


def _seen(
    pose: Pose, *plots: Plot, post: Prop = POST, errors: PerceptErrors = EXACT
) -> list[Percept]:
    """The percepts of charging places in a street with one."""
    street = Place(seed=1, roads=(STREET,), plots=plots, props=(post,), start=AT_ORIGIN)
    view = TownSensors(street, Surroundings(street), errors, MOUNT, 1).look(pose)
    return [percept for percept in view.objects if percept.name == CHARGING_PLACE]


def test_a_charging_place_is_seen_where_it_stands_with_its_function() -> None:
    (seen,) = _seen(AT_ORIGIN)

    assert seen.range_m == pytest.approx(math.hypot(20.0, 5.0), abs=5e-3)
    assert seen.bearing_rad == pytest.approx(math.atan2(5.0, 20.0), abs=1e-6)
    assert seen.function == "charge"
    assert seen.whole


@pytest.mark.parametrize("heading_rad", [math.pi, math.pi / 2])
def test_a_charging_place_outside_the_field_of_view_is_not_seen(heading_rad: float) -> None:
    assert _seen(Pose(x_m=0.0, y_m=0.0, heading_rad=heading_rad)) == []


def test_a_charging_place_far_away_is_not_seen() -> None:
    assert _seen(Pose(x_m=-15.0, y_m=0.0, heading_rad=0.0)) == []


def test_a_charging_place_behind_a_building_is_not_seen() -> None:
    bank = next(kind for kind in CATALOGUE if kind.name == "bank")

    assert _seen(AT_ORIGIN, Plot(bank, 11.0, 4.0, -math.pi / 2)) == []


def test_percepts_of_charging_places_have_the_errors_of_buildings() -> None:
    street = Place(seed=1, roads=(STREET,), plots=(), props=(POST,), start=AT_ORIGIN)
    sensors = TownSensors(street, Surroundings(street), PerceptErrors(detected=0.8), MOUNT, 1)

    views = [sensors.look(AT_ORIGIN).objects for _ in range(400)]
    ranges_m = [percept.range_m for percepts in views for percept in percepts]

    assert 0.7 < len(ranges_m) / len(views) < 0.9
    assert 0.3 < np.std(ranges_m) < 0.8
