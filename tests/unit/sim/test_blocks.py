"""Towns of several blocks from a seed."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.schemas import nodes
from cogmap.services.sim.layout.blocks import streets
from cogmap.services.sim.layout.blocks.districts import FUNCTIONS
from cogmap.services.sim.layout.blocks.town import BlocksTown, generate
from cogmap.services.sim.layout.boundaries import kerbs
from cogmap.services.sim.layout.plan import PAVEMENT_WIDTH_M, Point, Road, overlap

SEEDS = range(1, 7)
TOWNS = [generate(seed, 150.0 + 20.0 * seed) for seed in SEEDS]
ROBOT_WIDTH_M = 1.4


def _connected(roads: list[Road]) -> set[str]:
    """The names of the roads that are reached from the first."""
    reached = {roads[0].name}
    waiting = [roads[0]]
    while waiting:
        road = waiting.pop()
        for other in roads:
            if other.name not in reached and overlap(road.kerbs, other.kerbs):
                reached.add(other.name)
                waiting.append(other)

    return reached


def test_no_building_stands_on_a_street_or_another_building() -> None:
    for place in TOWNS:
        for road, plot in itertools.product(place.roads, place.plots):
            pavement = road.area(road.width_m / 2 + PAVEMENT_WIDTH_M)
            assert not overlap(pavement, plot.footprint)

        for one, other in itertools.combinations(place.plots, 2):
            assert not overlap(one.footprint, other.footprint)


def test_all_streets_are_connected() -> None:
    for place in TOWNS:
        assert len(_connected(list(place.roads))) == len(place.roads)


def _reached(ends: list[tuple[Point, Point]]) -> set[Point]:
    """The crossings that are reached from the first."""
    reached = {ends[0][0]}
    for _ in ends:
        for start, end in ends:
            if start in reached or end in reached:
                reached |= {start, end}

    return reached


def test_any_street_but_a_dead_end_can_be_closed() -> None:
    for seed in SEEDS:
        plan = streets.plan(np.random.default_rng(seed), 200.0)
        through = [road for road in plan.roads if road not in plan.dead_ends][:-1]
        for closed in through:
            ends = [(road.start, road.end) for road in through if road is not closed]
            crossings = {point for road in through for point in (road.start, road.end)}
            assert _reached(ends) == crossings


def test_streets_differ_in_width_and_have_names_of_their_own() -> None:
    for place in TOWNS:
        widths_m = {road.width_m for road in place.roads}
        assert len(widths_m) >= 4

        names = Counter(road.name for road in place.roads)
        assert max(names.values()) == 1


def test_a_town_has_a_square_and_dead_ends() -> None:
    for place in TOWNS:
        assert place.square in place.roads
        assert place.square.width_m >= 20.0
        assert len(place.dead_ends) >= 2


def test_districts_share_a_function_and_a_style() -> None:
    for place in TOWNS:
        districts = {plot.district for plot in place.plots}
        assert len(districts) >= 3

        for district in districts:
            plots = [plot for plot in place.plots if plot.district == district]
            functions = Counter(plot.function for plot in plots)
            _, most = functions.most_common(1)[0]
            assert set(functions) <= set(FUNCTIONS)
            assert most >= 0.6 * len(plots)

            invented = [plot.kind for plot in plots if "-" in plot.kind.name]
            assert len({kind.roof for kind in invented}) == 1
            assert len({kind.pattern for kind in invented}) <= 2


def test_every_function_is_one_that_schemes_may_name() -> None:
    assert FUNCTIONS.keys() <= {*nodes.FUNCTIONS}


def test_no_kind_of_building_is_built_twice() -> None:
    for place in TOWNS:
        names = [plot.kind.name for plot in place.plots]
        assert len(names) == len(set(names))
        assert len(names) > 60


def test_every_street_stays_wide_enough_to_drive() -> None:
    for place in TOWNS:
        assert any(prop.kind == "car" for prop in place.props)
        for road in place.roads:
            assert _tightest_m(place, road) > 2 * ROBOT_WIDTH_M


def _tightest_m(place: BlocksTown, road: Road) -> float:
    """The widest gap between kerbs and what stands between them, where that is narrowest."""
    solids_m = np.array([prop.solid for prop in place.props])
    along_m, left_m = _local_m(road, solids_m)
    half_m = road.width_m / 2
    is_on_road = (np.abs(left_m) < half_m).any(axis=1)
    begins_m = along_m.min(axis=1)
    ends_m = along_m.max(axis=1)

    tightest_m = road.width_m
    for here_m in np.arange(0.0, road.length_m, 0.5):
        is_here = is_on_road & (begins_m <= here_m) & (here_m <= ends_m)
        edges_m = np.sort([-half_m, *left_m[is_here].ravel(), half_m])
        tightest_m = min(tightest_m, np.diff(edges_m).max())

    return tightest_m


def _local_m(road: Road, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far points are along a road, and left of its centre line."""
    start_m = np.array(road.start)
    ahead = (np.array(road.end) - start_m) / road.length_m
    left = np.array([-ahead[1], ahead[0]])

    offset_m = points_m - start_m
    return offset_m @ ahead, offset_m @ left


def test_the_robot_starts_on_a_street_with_room_around_it() -> None:
    for place in TOWNS:
        start = place.start
        here = (start.x_m, start.y_m, start.x_m, start.y_m)
        assert any(overlap(road.kerbs, here) for road in place.roads)

        for prop in place.props:
            assert np.hypot(prop.x_m - start.x_m, prop.y_m - start.y_m) > 5.0


def test_the_same_seed_gives_the_same_town_and_another_one_does_not() -> None:
    assert encode(generate(3).message()) == encode(generate(3).message())
    assert encode(generate(3).message()) != encode(generate(4).message())


def test_a_larger_size_gives_a_larger_town() -> None:
    small = generate(1, 150.0)
    large = generate(1, 300.0)

    assert len(large.roads) > 2 * len(small.roads)
    assert max(plot.x_m for plot in large.plots) > 130.0


def test_a_kerb_has_a_street_on_one_of_its_sides() -> None:
    for place in TOWNS[:2]:
        segments_m = place.kerbs_m
        middles_m = (segments_m[:, :2] + segments_m[:, 2:]) / 2
        along = segments_m[:, 2:] - segments_m[:, :2]
        normals = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]

        for middle_m, normal in zip(middles_m, normals, strict=True):
            sides = [_is_street(place, middle_m + sign * 0.01 * normal) for sign in (-1, 1)]
            assert sorted(sides) == [False, True]


def _is_street(place: BlocksTown, point_m: np.ndarray) -> bool:
    x_m, y_m = point_m.tolist()
    for road in place.roads:
        west, south, east, north = road.kerbs
        if west < x_m < east and south < y_m < north:
            return True

    return False


def test_kerbs_of_two_crossing_streets_leave_the_crossing_open() -> None:
    east = Road("a", (-20.0, 0.0), (20.0, 0.0), 8.0)
    north = Road("b", (0.0, -20.0), (0.0, 20.0), 6.0)
    segments_m = kerbs([east, north])

    lengths_m = np.hypot(*(segments_m[:, 2:] - segments_m[:, :2]).T)
    both_m = 2 * (48.0 + 8.0) + 2 * (46.0 + 6.0)
    on_crossing_m = 2 * 6.0 + 2 * 8.0
    assert lengths_m.sum() == pytest.approx(both_m - on_crossing_m)

    middles_m = (segments_m[:, :2] + segments_m[:, 2:]) / 2
    is_on_crossing = (np.abs(middles_m) < (2.9, 3.9)).all(axis=1)
    assert not is_on_crossing.any()


def test_kerbs_of_slanted_streets_that_cross_are_cut_there_too() -> None:
    one = Road("a", (-20.0, -20.0), (20.0, 20.0), 8.0)
    other = Road("b", (-20.0, 20.0), (20.0, -20.0), 8.0)
    segments_m = kerbs([one, other])

    lengths_m = np.hypot(*(segments_m[:, 2:] - segments_m[:, :2]).T)
    assert lengths_m.sum() == pytest.approx(4 * (one.length_m + 16.0) - 4 * 8.0)


def test_a_street_on_another_adds_no_kerb() -> None:
    street = Road("a", (-20.0, 0.0), (20.0, 0.0), 8.0)
    inner = Road("b", (-5.0, 0.0), (5.0, 0.0), 6.0)

    assert kerbs([street, inner]).shape == (4, 4)
    assert kerbs([street, street]).shape == (4, 4)
