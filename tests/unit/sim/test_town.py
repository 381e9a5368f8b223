"""Generated towns: streets, buildings, props, and laps of them."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.geometry.se2 import transform_from
from cogmap.services.sim.layout import town
from cogmap.services.sim.layout.catalogue import CATALOGUE, invented
from cogmap.services.sim.layout.plan import PAVEMENT_WIDTH_M, STREET_WIDTH_M, overlap
from cogmap.services.sim.rendering import facade, mesh

SEEDS = range(25)
TOWNS = [town.generate(seed) for seed in SEEDS]
LOOP_ROADS = 4


def _on_loop(place: town.Town, x_m: float, y_m: float, margin_m: float) -> bool:
    """Whether a point is within a margin of a street of the loop."""
    point = (x_m, y_m, x_m, y_m)
    return any(overlap(point, road.area(margin_m)) for road in place.roads[:LOOP_ROADS])


def test_one_seed_gives_one_town_and_another_seed_another() -> None:
    first = [encode(place.message()) for place in TOWNS]
    again = []
    for seed in SEEDS:
        place = town.generate(seed)
        again.append(encode(place.message()))

    assert again == first
    assert len(set(again)) == len(again)


def test_every_town_has_at_least_20_buildings_and_none_of_them_twice() -> None:
    for place in TOWNS:
        names = [building.name for building in place.message().buildings]

        assert len(names) >= 20
        assert len(set(names)) == len(names)


def test_no_building_stands_on_a_pavement_or_on_another_building() -> None:
    half_width_m = STREET_WIDTH_M / 2 + PAVEMENT_WIDTH_M
    for place in TOWNS:
        for road, plot in itertools.product(place.roads, place.plots):
            assert not overlap(road.area(half_width_m), plot.footprint)

        for one, other in itertools.combinations(place.plots, 2):
            assert not overlap(one.footprint, other.footprint)


def test_no_prop_stands_on_a_street_or_in_a_building_or_in_another_prop() -> None:
    for place in TOWNS:
        assert len(place.props) > 20

        streets = [road.area(STREET_WIDTH_M / 2) for road in place.roads]
        buildings = [plot.footprint for plot in place.plots]
        for prop, taken in itertools.product(place.props, streets + buildings):
            assert not overlap(prop.area, taken)

        for one, other in itertools.combinations(place.props, 2):
            assert not overlap(one.area, other.area)


def test_invented_kinds_are_the_same_for_a_seed_and_of_no_catalogue() -> None:
    kinds = invented(7, 20)
    others = invented(8, 20)
    walls = {kind.wall for kind in (*kinds, *others)}
    names = {kind.name for kind in kinds}
    known = {kind.name for kind in CATALOGUE}

    assert kinds == invented(7, 20)
    assert len(walls) == 40
    assert not names & known

    built = town.generate(3, invented(3, 28))
    assert len(built.plots) >= town.MIN_BUILDINGS


def test_every_front_looks_at_a_street_of_the_loop() -> None:
    to_middle_m = 2.0 + PAVEMENT_WIDTH_M + STREET_WIDTH_M / 2
    for place in TOWNS:
        for plot in place.plots:
            ahead_m = plot.kind.depth_m / 2 + to_middle_m
            x_m = plot.x_m + ahead_m * math.sin(plot.heading_rad)
            y_m = plot.y_m - ahead_m * math.cos(plot.heading_rad)

            assert _on_loop(place, x_m, y_m, STREET_WIDTH_M / 2)


def _goals_in_town(place: town.Town, laps: float) -> list[tuple[float, float]]:
    """The goals of some laps in the frame of the town."""
    start = np.array([place.start.x_m, place.start.y_m, place.start.heading_rad])
    goals_m = transform_from(start, np.array(place.goals(laps)))
    return [(x_m, y_m) for x_m, y_m in goals_m.tolist()]


def test_the_goals_of_a_lap_are_the_corners_in_order_and_the_start() -> None:
    for place in TOWNS:
        *corners, end = _goals_in_town(place, 1.0)

        assert np.array(corners) == pytest.approx(np.array(place.corners))
        assert end == pytest.approx((place.start.x_m, place.start.y_m))


def test_the_first_goal_is_straight_ahead_in_the_frame_of_the_start() -> None:
    for place in TOWNS:
        x_m, y_m = place.goals()[0]

        assert x_m > 10.0
        assert y_m == pytest.approx(0.0)


@pytest.mark.parametrize("laps", [0.1, 0.5, 1.0, 1.7, 3.0])
def test_the_way_past_the_goals_is_as_long_as_the_laps_along_the_streets(laps: float) -> None:
    place = TOWNS[3]
    goals_m = _goals_in_town(place, laps)
    start_m = (place.start.x_m, place.start.y_m)
    lengths_m = [math.dist(a, b) for a, b in itertools.pairwise([start_m, *goals_m])]

    assert sum(lengths_m) == pytest.approx(laps * place.lap_m)
    assert all(_on_loop(place, x_m, y_m, 0.01) for x_m, y_m in goals_m)


@pytest.mark.parametrize(("laps", "goals"), [(0.05, 1), (1.0, 5), (3.0, 13)])
def test_each_corner_and_the_end_is_a_goal(laps: float, goals: int) -> None:
    assert len(TOWNS[0].goals(laps)) == goals


def _histogram(picture: np.ndarray) -> np.ndarray:
    """Which share of a picture's pixels has each of 512 colours."""
    colours = picture.reshape(-1, 3)
    counts, _ = np.histogramdd(colours, bins=(8, 8, 8), range=[(0, 256)] * 3)
    return counts / len(colours)


def test_each_kind_of_building_has_colours_of_its_own() -> None:
    histograms = []
    for kind in CATALOGUE:
        front = facade.side(kind, kind.width_m, 0)
        histograms.append(_histogram(front))

    for one, other in itertools.combinations(histograms, 2):
        assert np.minimum(one, other).sum() < 0.8


def test_a_building_has_the_size_of_its_kind_and_its_picture_lies_within() -> None:
    for kind in CATALOGUE:
        surface, picture = mesh.building(kind)
        sides_m = np.ptp(surface.vertices, axis=0)

        assert sides_m == pytest.approx((kind.width_m, kind.depth_m, kind.height_m))
        assert np.min(surface.uvs) >= 0
        assert np.max(surface.uvs) <= 1
        assert picture.shape[1] % 4 == 0
