"""Routes over large maps: rough on coarse maps, refined within their corridor."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Cells, DropNode, DropPlaces
from cogmap.schemas.nodes import (
    PLAN_ID,
    ROOT_MAP,
    Goal,
    Map,
    PlaceColumn,
    Plan,
    PlanState,
    goal_id,
    map_id,
)
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.corridor import corridor
from cogmap.services.codelets.planning.route_plan import run
from cogmap.services.codelets.planning.sub_map_routes import sub_map_routes
from cogmap.services.codelets.planning.targets import goals_m
from cogmap.services.codelets.sub_maps import coarse_places, sub_map_places
from cogmap.services.codelets.sub_maps.sub_map_grid import SETTLED_CYCLES
from cogmap.testing import agent, graph_of, task

SIDE = 240
EVERY = 40
WIDTH = 6
ROUGH = Config(search_places=1000)
FLAT = Config()
FAR = Goal(id=goal_id("far"), base_level=1.0, x_m=203.0, y_m=163.0)


def _column(column: PlaceColumn, chosen: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Cells:
    cells = np.argwhere(chosen)
    values = np.ones(len(cells), np.float32)
    return Cells(column=column, cells=Array.of(cells, "<i4"), values=Array.of(values))


def _city(*goals: Goal, wall: slice | None = None) -> Graph:
    """Streets every 40 m both ways, buildings between them, and coarse maps; a wall across all at
    some i.
    """
    at = np.arange(SIDE) % EVERY <= WIDTH
    is_road = at[:, None] | at
    stands = ~is_road
    if wall is not None:
        stands[wall] = True

    graph = graph_of(agent(x_m=3.0, y_m=3.0), *goals)
    graph.change([_column(PlaceColumn.ROAD, is_road), _column(PlaceColumn.OBSTACLE, stands)])
    coarse_places.make_all(graph)
    return graph


def _plan(graph: Graph, config: Config) -> Plan:
    graph.change(run(task("route_plan"), graph, config).operations)
    plan = graph.get(Plan, PLAN_ID)
    assert plan is not None
    return plan


def test_a_rough_route_is_nearly_as_short_as_one_over_the_whole_map() -> None:
    rough = _plan(_city(FAR), ROUGH)
    whole = _plan(_city(FAR), FLAT)

    assert rough.state is PlanState.READY
    assert whole.length_m <= rough.length_m <= 1.05 * whole.length_m


def test_the_papers_gradient_leads_over_the_finest_map_alone() -> None:
    gradient = msgspec.structs.replace(ROUGH, planning="gradient")
    graph = _city(FAR)
    graph.change([DropPlaces(map=each.id) for each in graph.of_kind(Map) if each.id != ROOT_MAP])
    plan = _plan(graph, gradient)

    assert plan.state is PlanState.READY
    assert plan.length_m == pytest.approx(_plan(_city(FAR), gradient).length_m)
    assert plan.length_m >= _plan(_city(FAR), FLAT).length_m


def test_a_corridor_holds_the_plan_and_little_else() -> None:
    graph = _city(FAR)
    assert graph.agent is not None
    found = corridor(graph, graph.agent, goals_m(graph, graph.agent), ROUGH)

    assert found is not None
    plan = _plan(graph, ROUGH)
    assert plan.route is not None
    cells = np.rint(plan.route.numpy()).astype(int) - found.extent.lower
    assert found.is_inside[tuple(cells.T)].all()
    assert found.is_inside.sum() < 0.5 * SIDE**2


@pytest.mark.parametrize("goals", [[], [Goal(id=goal_id("away"), x_m=9e3, y_m=0.0)]])
def test_there_is_no_corridor_without_a_goal_on_the_map(goals: list[Goal]) -> None:
    graph = _city(*goals)
    assert graph.agent is not None

    assert corridor(graph, graph.agent, goals_m(graph, graph.agent), ROUGH) is None


def test_a_small_map_is_planned_on_as_a_whole() -> None:
    graph = _city(FAR)
    assert graph.agent is not None

    assert corridor(graph, graph.agent, goals_m(graph, graph.agent), FLAT) is None


def test_several_goals_are_ordered_and_the_first_is_driven_to() -> None:
    near = Goal(id=goal_id("near"), base_level=1.0, x_m=43.0, y_m=3.0)
    plan = _plan(_city(FAR, near), ROUGH)

    assert plan.goals == [near.id, FAR.id]
    assert plan.unreachable == {}


def test_where_coarse_maps_know_of_no_route_the_whole_map_is_searched() -> None:
    graph = _city(FAR, wall=slice(100, 101))
    open_again = np.zeros((SIDE, SIDE), bool)
    open_again[100, 80 : 80 + WIDTH] = True
    cells = _column(PlaceColumn.OBSTACLE, open_again)
    values = np.zeros(cells.values.shape, np.float32)
    graph.change([msgspec.structs.replace(cells, values=Array.of(values))])

    plan = _plan(graph, ROUGH)
    assert plan.state is PlanState.READY
    assert plan.unreachable == {}


def test_a_street_just_closed_in_the_corridor_is_driven_round_not_doubted() -> None:
    graph = _city(FAR)
    before = _plan(graph, ROUGH)
    assert before.route is not None
    half_i, half_j = np.rint(before.route.numpy()[len(before.route.numpy()) // 2]).astype(int)
    stands = np.zeros((SIDE, SIDE), bool)
    stands[half_i - 12 : half_i + 13, half_j - 12 : half_j + 13] = True
    graph.change([_column(PlaceColumn.OBSTACLE, stands)])

    plan = _plan(graph, ROUGH)
    assert plan.state is PlanState.READY
    assert not plan.doubtful
    assert plan.route is not None
    cells = np.rint(plan.route.numpy()).astype(int)
    assert not stands[tuple(cells.T)].any()


def _quarter(graph: Graph, heading_rad: float = 0.0) -> Graph:
    """The city with a sub-map of 160 m around (120, 120), and the places of that alone."""
    node = Map(
        id=map_id(1),
        parent=ROOT_MAP,
        cell_m=2.0,
        x_m=120.5,
        y_m=119.5,
        heading_rad=heading_rad,
        width_m=160.0,
        height_m=160.0,
    )
    graph.change([node])
    graph.cycle = SETTLED_CYCLES
    sub_map_places.make_all(graph, graph.cycle)
    return graph


def _from_to(graph: Graph, start_m: tuple[float, float], goal_m: tuple[float, float]) -> Graph:
    x_m, y_m = start_m
    goal = Goal(id=goal_id("there"), base_level=1.0, x_m=goal_m[0], y_m=goal_m[1])
    graph.change([agent(x_m=x_m, y_m=y_m), goal])
    return graph


@pytest.mark.parametrize("heading_rad", [0.0, 0.3])
def test_a_route_within_a_sub_map_is_found_on_its_grid(heading_rad: float) -> None:
    ends = (83.0, 110.0), (140.0, 123.0)
    graph = _from_to(_quarter(_city(), heading_rad), *ends)
    held = sub_map_routes(graph, np.array(ends), ROUGH)
    assert held is not None
    assert graph.agent is not None
    found = corridor(graph, graph.agent, goals_m(graph, graph.agent), ROUGH)
    assert found is not None

    cells = np.rint(held.passed_m).astype(int) - found.extent.lower
    assert found.is_inside[tuple(cells.T)].all()
    whole = _plan(_from_to(_city(), *ends), FLAT)
    assert whole.length_m <= _plan(graph, ROUGH).length_m <= 1.05 * whole.length_m


def test_a_sub_map_does_without_the_coarse_maps() -> None:
    graph = _from_to(_quarter(_city()), (83.0, 110.0), (140.0, 123.0))
    for name in [node.id for node in graph.of_kind(Map) if node.id not in (ROOT_MAP, map_id(1))]:
        graph.change([DropNode(id=name)])
    assert graph.agent is not None

    assert corridor(graph, graph.agent, goals_m(graph, graph.agent), ROUGH) is not None


@pytest.mark.parametrize(
    ("start_m", "goal_m"),
    [
        # Outside the sub-map; and at its border, where a route beyond might be shorter.
        ((3.0, 3.0), (140.0, 123.0)),
        ((43.0, 100.0), (63.0, 163.0)),
    ],
)
def test_where_a_route_may_lead_outside_a_sub_map_the_coarse_maps_are_searched(
    start_m: tuple[float, float], goal_m: tuple[float, float]
) -> None:
    graph = _from_to(_quarter(_city()), start_m, goal_m)
    assert sub_map_routes(graph, np.array([start_m, goal_m]), ROUGH) is None

    assert graph.agent is not None
    assert corridor(graph, graph.agent, goals_m(graph, graph.agent), ROUGH) is not None


def test_a_sub_map_of_which_no_place_is_known_yet_is_not_planned_on() -> None:
    ends = (83.0, 110.0), (140.0, 123.0)
    graph = _quarter(_city())
    graph.change([DropPlaces(map=map_id(1))])

    assert sub_map_routes(graph, np.array(ends), ROUGH) is None
