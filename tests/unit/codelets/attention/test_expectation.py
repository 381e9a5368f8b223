"""A building of the map that is gone is a surprise, and a street that is closed."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.cognition import Coalition
from cogmap.schemas.graph import Cells, Delta, Link, Operation, Phase
from cogmap.schemas.nodes import (
    PLAN_ID,
    AnyNode,
    Attention,
    LinkKind,
    PathColumn,
    PathSegment,
    PlaceColumn,
    Plan,
    PlanState,
    attention_id,
    place_cell,
    segment_id,
)
from cogmap.services.codelets.attention.disappearance import MAX_OBJECTS
from cogmap.services.codelets.attention.expectation import Config
from cogmap.testing import agent, graph_of, landmark, percept, task
from tests.support.world.scenes import run

VIEWS = 3
"""So many in which rays pass where a house stood are a surprise; twice as many without."""
CONFIG = Config(views=2 * VIEWS)
HOUSE_M = 20.0
BEARINGS_RAD = np.linspace(-0.5, 0.5, 21)


def _house(**facts: Any) -> AnyNode:
    usual = {"sightings": 50, "width_m": 8.0, "base_level": 1.0, "activation": 0.0}
    return landmark("house", [(HOUSE_M, 0.0)], **(usual | facts))


def _scan(range_m: float) -> Array:
    ranges_m = np.full(len(BEARINGS_RAD), range_m)
    return Array.of(np.column_stack([BEARINGS_RAD, ranges_m]), "<f4")


FREE = _scan(HOUSE_M + 15.0)
NOTHING = _scan(0.0)
WALL = _scan(HOUSE_M - 3.0)
FENCE = _scan(HOUSE_M / 4)


class Story:
    """An agent that looks east to where a house stood, cycle by cycle."""

    def __init__(self, *operations: Operation) -> None:
        self.graph: Graph = graph_of(agent(), *operations)

    def look(self, scan: Array = FREE, *labels: str, **facts: Any) -> list[Coalition]:
        """What is brought in the next cycle."""
        cycle = self.graph.cycle + 1
        self.commit(Phase.LOCALIZATION, [agent(**facts)], cycle)
        percepts = [percept(label, 0.0, HOUSE_M) for label in labels]
        asked: Task = task("expectation", cycle=cycle, percepts=percepts, scan=scan)
        answer = run(asked, self.graph, CONFIG)
        self.commit(Phase.ATTENTION, answer.operations, cycle)
        return answer.coalitions

    def looks(self, number: int, scan: Array = FREE, **facts: Any) -> list[Coalition]:
        """What is brought in so many cycles."""
        found = []
        for _ in range(number):
            found += self.look(scan, **facts)
        return found

    def broadcast(self) -> None:
        """What was brought last becomes conscious."""
        memory = self.graph.get(Attention, attention_id("expectation"))
        assert memory is not None
        conscious = msgspec.structs.replace(memory, conscious_cycle=self.graph.cycle)
        self.commit(Phase.PERCEPTS, [conscious], self.graph.cycle)

    def commit(self, phase: Phase, operations: list[Operation], cycle: int) -> None:
        """Change the graph."""
        delta = Delta(
            version=self.graph.version + 1, cycle=cycle, phase=phase, operations=operations
        )
        assert self.graph.apply(delta)


@pytest.mark.parametrize("scan", [FREE, NOTHING], ids=["beyond", "nothing"])
def test_a_house_that_is_missing_in_several_views_is_a_surprise(scan: Array) -> None:
    story = Story(_house())

    assert story.looks(VIEWS - 1, scan) == []
    (found,) = story.look(scan)
    assert [node.id for node in found.nodes] == ["self", "object:house"]
    assert found.nodes[1].salience == -1.0
    assert found.activation > 0.5


def test_a_surprise_is_brought_again_until_it_is_conscious() -> None:
    story = Story(_house())
    brought = story.looks(VIEWS + 4)
    story.broadcast()

    assert len(brought) == 3
    assert story.looks(10) == []


def test_a_house_that_is_seen_again_is_none() -> None:
    story = Story(_house())
    story.looks(VIEWS - 1)
    story.look(FREE, "house")

    assert story.looks(VIEWS - 1) == []


def test_a_house_that_was_seen_to_be_gone_is_a_surprise_again_after_a_while_away() -> None:
    story = Story(_house())
    story.looks(VIEWS)
    story.broadcast()
    story.look(x_m=-500.0)

    assert len(story.looks(VIEWS)) == 1


@pytest.mark.parametrize(
    "facts",
    [
        {"sightings": 3},
        {"misses": 1},
        {"x_sd_m": 5.0},
        {"map": "map:1"},
        {"width_m": 0.5},
    ],
    ids=lambda facts: next(iter(facts)),
)
def test_what_is_not_known_well_or_too_narrow_is_not_expected(facts: dict[str, Any]) -> None:
    assert Story(_house(**facts)).looks(2 * VIEWS) == []


@pytest.mark.parametrize("at_m", [(4.0, 0.0), (80.0, 0.0), (0.0, 20.0), (-20.0, 0.0)])
def test_what_is_too_near_or_far_or_aside_is_not_expected(at_m: tuple[float, float]) -> None:
    house = landmark("house", [at_m], sightings=50, width_m=8.0)

    assert Story(house).looks(2 * VIEWS, NOTHING) == []


def test_a_house_behind_what_the_scan_hits_is_hidden() -> None:
    assert Story(_house()).looks(2 * VIEWS, WALL) == []


@pytest.mark.parametrize(("range_m", "number"), [(HOUSE_M + 15.0, 1), (HOUSE_M / 4, 0)])
def test_aside_where_perception_is_weak_rays_that_pass_say_that_a_house_is_gone(
    range_m: float, number: int
) -> None:
    house = landmark("house", [(14.0, 14.0)], sightings=50, width_m=8.0)
    bearings_rad = np.linspace(-0.9, 0.9, 37)
    scan = Array.of(np.column_stack([bearings_rad, np.full(37, range_m)]), "<f4")

    assert len(Story(house).looks(VIEWS, scan)) == number


def test_what_is_low_and_stops_the_scan_hides_no_house() -> None:
    story = Story(_house())

    assert story.looks(2 * VIEWS - 1, FENCE) == []
    assert len(story.looks(1, FENCE)) == 1


@pytest.mark.parametrize(("aside_m", "number"), [(0.0, 0), (3.0, 0), (8.0, 1)])
def test_a_house_that_is_known_to_stand_before_another_hides_it(
    aside_m: float, number: int
) -> None:
    before = landmark("before", [(HOUSE_M / 2, aside_m)], width_m=8.0)

    assert len(Story(_house(), before).looks(2 * VIEWS, FENCE)) == number


def test_views_in_which_a_house_is_hidden_do_not_count() -> None:
    story = Story(_house())
    story.looks(VIEWS - 1)

    assert story.looks(3, WALL) == []
    assert len(story.look()) == 1


def test_an_agent_that_does_not_know_where_it_is_expects_nothing() -> None:
    assert Story(_house()).looks(2 * VIEWS, x_sd_m=4.0) == []


def test_on_a_map_of_many_objects_the_same_is_expected() -> None:
    crowd = []
    for number in range(MAX_OBJECTS + 1):
        crowd.append(landmark(f"far-{number}", [(1000.0, number)], sightings=50))
    house = _house()
    at = _at_its_place(house)

    assert len(Story(house, at, *crowd).looks(VIEWS)) == 1


def _at_its_place(house: AnyNode) -> Operation:
    """The link of the house to its place."""
    return Link(source=house.id, target=f"place:map:0:{round(HOUSE_M)}:0", kind=LinkKind.AT)


def _cells(column: PlaceColumn, cells: list[tuple[int, int]]) -> Cells:
    values = np.ones(len(cells), np.float32)
    return Cells(column=column, cells=Array.of(np.array(cells, np.int32)), values=Array.of(values))


ROUTE_M = [(float(i), 0.0) for i in range(60)]
ROAD = _cells(PlaceColumn.ROAD, [(i, j) for i in range(60) for j in range(-3, 4)])
BARRIER_M = 20.0


def _barrier(at_m: float = BARRIER_M, rightmost_m: float = -3.0, leftmost_m: float = 3.0) -> Array:
    """A scan that ends at a barrier across a street to the east, and goes on beside it."""
    across_m = at_m * np.tan(BEARINGS_RAD)
    is_hit = (across_m >= rightmost_m) & (across_m <= leftmost_m)
    ranges_m = np.where(is_hit, at_m / np.cos(BEARINGS_RAD), at_m + 20.0)
    return Array.of(np.column_stack([BEARINGS_RAD, ranges_m]), "<f4")


BARRIER = _barrier()


def _plan(route_m: list[tuple[float, float]] = ROUTE_M, **facts: Any) -> Plan:
    route = Matrix.of(np.array(route_m))
    return Plan(id=PLAN_ID, base_level=1.0, state=PlanState.READY, route=route, **facts)


def _driven(heading_rad: float = 0.0) -> PathSegment:
    """A path along the middle of the road, where the agent came or that it crossed."""
    rows = np.zeros((40, len(PathColumn)))
    rows[:, PathColumn.X_M] = np.arange(40)
    rows[:, PathColumn.HEADING_RAD] = heading_rad
    return PathSegment(id=segment_id(0), number=0, rows=Matrix.of(rows))


def test_a_street_of_the_plan_that_is_closed_in_two_views_is_a_surprise() -> None:
    story = Story(_plan(), ROAD)

    assert story.look(BARRIER) == []
    (found,) = story.look(BARRIER)
    (blocked,) = [link for link in found.links if link.kind == LinkKind.BLOCKED]
    assert [node.id for node in found.nodes] == ["self", "plan"]
    assert (blocked.source, _metres_away(blocked.target)) == ("plan", pytest.approx(20.0, abs=2))
    assert found.nodes[1].salience == -1.0
    assert found.activation > 0.5


def _metres_away(place: str) -> float:
    cell = place_cell(place)
    assert cell is not None
    return math.hypot(*cell[1:])


def test_a_street_that_seems_closed_in_one_view_and_much_later_in_another_is_none() -> None:
    story = Story(_plan(), ROAD)
    story.look(BARRIER)
    story.looks(10)

    assert story.look(BARRIER) == []


def test_a_closure_is_one_surprise() -> None:
    story = Story(_plan(), ROAD)
    story.looks(2, BARRIER)
    story.broadcast()

    assert story.looks(10, BARRIER) == []


def test_a_closure_is_brought_until_it_is_conscious_though_the_plan_is_another_by_then() -> None:
    story = Story(_plan(), ROAD)
    story.looks(2, BARRIER)
    story.commit(Phase.BACKGROUND, [_plan(doubtful=True)], story.graph.cycle)

    assert len(story.looks(2)) == 1


def test_a_street_that_the_agent_drove_along_is_a_surprise_off_its_route_where_it_is_closed() -> (
    None
):
    (found,) = Story(_driven(), ROAD).looks(2, BARRIER)
    blocked = [link for link in found.links if link.kind == LinkKind.BLOCKED]

    assert [node.id for node in found.nodes] == ["self"]
    assert [link.source for link in blocked] == ["self"]
    assert found.nodes[0].salience == -1.0


@pytest.mark.parametrize(
    "scan",
    [
        _barrier(rightmost_m=0.0, leftmost_m=8.0),
        _barrier(rightmost_m=2.8, leftmost_m=20.0),
        _barrier(at_m=2.5),
        _barrier(at_m=50.0),
        NOTHING,
        _scan(60.0),
    ],
    ids=["on one side", "beside", "too near", "too far", "nothing seen", "free"],
)
def test_what_does_not_stand_across_where_the_agent_drove_closes_nothing(scan: Array) -> None:
    assert Story(_driven(), ROAD).looks(3, scan) == []


def test_what_stands_along_where_the_agent_drove_closes_nothing() -> None:
    assert Story(_driven(math.pi / 2), ROAD).looks(3, BARRIER) == []


def test_a_wall_behind_a_bend_closes_nothing() -> None:
    bend_m = [(float(i), 0.0) for i in range(20)] + [(20.0, float(j)) for j in range(20)]
    road = _cells(PlaceColumn.ROAD, [(round(i), round(j)) for i, j in bend_m])

    assert Story(_plan(bend_m), road).looks(3, _barrier(at_m=21.0)) == []


@pytest.mark.parametrize(
    "operations",
    [
        (_plan(),),
        (_plan(doubtful=True), ROAD),
        (Plan(id=PLAN_ID, state=PlanState.NO_ROUTE), ROAD),
    ],
    ids=["never road", "in doubt", "no route"],
)
def test_what_the_plan_did_not_count_on_is_no_surprise(operations: tuple[Operation, ...]) -> None:
    assert Story(*operations).looks(3, BARRIER) == []


def test_a_closure_behind_the_agent_is_no_surprise() -> None:
    assert Story(_plan(), ROAD).looks(3, BARRIER, x_m=30.0, heading_rad=math.pi) == []
