"""What exploration is judged by: routes in the true town, goals, closed streets, cut links."""

from __future__ import annotations

import itertools
import math

import msgspec
import numpy as np
import pytest

from benchmarks.explore.boundaries import BoundaryScore
from benchmarks.explore.drivable import Drivable
from benchmarks.explore.judge import explored_share, score_boundaries
from benchmarks.explore.measure import Town, metrics
from benchmarks.explore.trials import (
    SIGHT_M,
    Trial,
    believed_m,
    closed_as,
    draw_goal,
    sees_barrier,
    street_to_close,
)
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Cells
from cogmap.schemas.nodes import PlaceColumn
from cogmap.schemas.sensing import Street, TrueTown
from cogmap.testing import cells, graph_of

ORIGIN = np.zeros(3)
CORNERS = ((0.0, 0.0), (60.0, 0.0), (60.0, 40.0), (0.0, 40.0))
NAMES = ("south", "east", "north", "west")


def _town() -> TrueTown:
    """A loop of four streets, 60 m and 40 m long, 6 m wide."""
    ends = zip(NAMES, CORNERS, (*CORNERS[1:], CORNERS[0]), strict=True)
    streets = [Street(name=name, line_m=[a, b], width_m=6.0) for name, a, b in ends]
    kerbs_m = np.array([[0.0, -3.4, 60.0, -3.4]], np.float32)
    return TrueTown(seed=1, streets=streets, buildings=[], kerbs_m=Array.of(kerbs_m))


def _cells(column: PlaceColumn, i: range, j: range, value: float) -> Cells:
    return cells(column, dict.fromkeys(itertools.product(i, j), value))


def _trial(driven_m: float | None, closed: str = "") -> Trial:
    return Trial(
        start_m=(0.0, 0.0),
        goal_m=(50.0, 0.0),
        began_ns=0,
        began_travelled_m=0.0,
        closes=bool(closed),
        shortest_m=50.0,
        unwarned_m=60.0 if closed else 50.0,
        closed=closed,
        driven_m=driven_m,
    )


def test_the_shortest_route_leads_along_the_street() -> None:
    length_m = Drivable.of(_town()).length_m((0.0, 0.0), (50.0, 0.0))

    assert length_m == pytest.approx(50.0, rel=0.03)


def test_where_a_street_is_closed_the_shortest_route_leads_round() -> None:
    town = closed_as(_town(), "south")
    length_m = Drivable.of(town).length_m((0.0, 0.0), (50.0, 0.0))

    assert 120.0 < length_m < 155.0


def test_to_a_place_that_is_shut_off_there_is_no_route() -> None:
    town = closed_as(closed_as(_town(), "south"), "north")

    assert math.isinf(Drivable.of(town).length_m((0.0, 0.0), (60.0, 20.0)))


def test_a_goal_is_on_a_street_and_far_enough() -> None:
    town = _town()
    goal_m, length_m = draw_goal(np.random.default_rng(1), town, Drivable.of(town), (0.0, 0.0))

    assert Drivable.of(town).is_on(*goal_m)
    assert length_m >= 40.0


def test_the_street_that_is_closed_is_on_the_route_and_leaves_another() -> None:
    route_m = np.column_stack([np.arange(51.0), np.zeros(51)])
    found = street_to_close(np.random.default_rng(1), _town(), route_m, (50.0, 0.0))

    assert found is not None
    assert found.street == "south"
    assert found.shortest_m > 120.0


def test_an_agent_that_sees_only_from_near_that_a_street_is_closed_drives_there_and_back() -> None:
    route_m = np.column_stack([np.arange(51.0), np.zeros(51)])
    found = street_to_close(np.random.default_rng(1), _town(), route_m, (50.0, 0.0))

    assert found is not None
    there_m = 30.0 - SIGHT_M
    there_and_back_m = 2 * there_m
    assert found.shortest_m < found.unwarned_m <= found.shortest_m + there_and_back_m


def test_an_agent_that_nobody_tells_that_a_street_is_open_again_drives_round_it() -> None:
    believed = closed_as(_town(), "south")
    shut_off = closed_as(believed, "north")

    round_m = believed_m(_town(), believed, (0.0, 0.0), (50.0, 0.0))
    assert round_m == Drivable.of(believed).length_m((0.0, 0.0), (50.0, 0.0))

    tried_m = believed_m(_town(), shut_off, (0.0, 0.0), (50.0, 0.0))
    assert tried_m == Drivable.of(_town()).length_m((0.0, 0.0), (50.0, 0.0))


@pytest.mark.parametrize(("away_m", "is_seen"), [(SIGHT_M - 0.5, True), (SIGHT_M + 0.5, False)])
def test_whether_a_street_is_closed_is_seen_from_near(away_m: float, is_seen: bool) -> None:
    street = Street(name="south", line_m=[(0.0, 0.0), (60.0, 0.0)], width_m=6.0)
    here_m = np.array([30.0 + away_m, 0.0])

    assert sees_barrier(street, here_m) == is_seen


def test_a_street_is_not_closed_where_its_barrier_would_stand_at_the_goal() -> None:
    route_m = np.column_stack([np.arange(31.0), np.zeros(31)])

    assert street_to_close(np.random.default_rng(1), _town(), route_m, (30.0, 2.5)) is None


def test_a_square_is_not_closed() -> None:
    town = _town()
    square = Street(name="square", line_m=[(28.0, 0.0), (32.0, 0.0)], width_m=30.0)
    west = Street(name="south-west", line_m=[(0.0, 0.0), (28.0, 0.0)], width_m=6.0)
    east = Street(name="south-east", line_m=[(32.0, 0.0), (60.0, 0.0)], width_m=6.0)
    _, *others = town.streets
    streets = [square, west, east, *others]
    route_m = np.column_stack([np.linspace(15.0, 40.0, 26), np.zeros(26)])

    found = street_to_close(
        np.random.default_rng(1),
        msgspec.structs.replace(town, streets=streets),
        route_m,
        (40.0, 0.0),
    )

    assert found is None


def test_explored_is_what_the_map_has_as_road() -> None:
    south = _cells(PlaceColumn.ROAD, range(61), range(-2, 3), 1.0)

    assert explored_share(graph_of(south), _town(), ORIGIN) == pytest.approx(0.3, abs=0.05)
    assert explored_share(graph_of(), _town(), ORIGIN) == 0.0


def test_the_links_of_a_map_are_judged_in_the_frame_of_its_agent() -> None:
    kerb = _cells(PlaceColumn.WEIGHT_N, range(-29, 30), range(-4, -3), 0.0)
    seen = _cells(PlaceColumn.EVIDENCE_N, range(-29, 30), range(-4, 3), -1.0)
    start = np.array([30.0, 0.0, 0.0])
    found = score_boundaries(graph_of(kerb, seen), _town(), start)

    assert found.precision == 1.0
    assert found.recall > 0.9


def test_goals_that_are_not_reached_count_and_do_not_lengthen_the_way() -> None:
    score = BoundaryScore(precision=0.9, recall=0.8, cut=10, crossed=10)
    town = Town(0.9, score, [_trial(55.0), _trial(None), _trial(60.0, "south")], collisions=1)
    found = metrics([town])

    assert found["goals_reached_share"] == pytest.approx(2 / 3)
    assert found["way_over_shortest"] == pytest.approx(1.15)
    assert found["way_over_shortest_open"] == pytest.approx(1.1)
    assert found["unwarned_over_shortest"] == pytest.approx(1.1)
    assert found["way_over_unwarned"] == pytest.approx(1.05)
    assert found["collisions"] == 1.0
