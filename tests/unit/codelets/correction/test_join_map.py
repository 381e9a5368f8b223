from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import CycleContext
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.graph import Delta, Link, Operation, Phase
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    PLAN_ID,
    RECOLLECTION_ID,
    ROOT_MAP,
    TILE_CELLS,
    Correction,
    Goal,
    LinkKind,
    Map,
    Object,
    PathSegment,
    PlaceColumn,
    Plan,
    PlanState,
    Recollection,
    SubMap,
    goal_id,
    map_id,
    object_id,
)
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.correction import join_map
from cogmap.testing import agent, graph_of, landmark, percepts, task
from tests.support.world.scenes import run

QUARTER_RAD = math.pi / 2
CONFIG = Config()


def recollection() -> Recollection:
    """A map on which this one lies 100 m to the east, turned to the left by a quarter."""
    road = np.zeros((1, TILE_CELLS))
    road[0, 3 * 32 + 4] = 0.75
    evidence = np.zeros((1, TILE_CELLS))
    evidence[0, 3 * 32 + 4] = -2.5
    objects = [[100.0, 10.0, 0.5, 0.5, 8.0, 6.0, 20.0], [60.0, 60.0, 0.5, 0.5, 9.0, 5.0, 12.0]]
    return Recollection(
        id=RECOLLECTION_ID,
        map="remembered:1",
        x_m=100.0,
        y_m=0.0,
        heading_rad=QUARTER_RAD,
        labels=["12a", "30b"],
        names=["house", "house"],
        given_names=["", "the mill"],
        functions=["home", "home"],
        matched=["41a", ""],
        objects=Matrix.of(objects),
        tiles=[(2, -1)],
        columns={
            PlaceColumn.ROAD: Matrix.of(road, "<f2"),
            PlaceColumn.EVIDENCE_E: Matrix.of(evidence, "<f2"),
        },
    )


def joined(*operations: Operation) -> Graph:
    """A graph with these and a recollection, this one if there is no other, after the map was
    joined.
    """
    graph = graph_of(agent(x_m=0.0), recollection(), *operations)
    answer = run(task("join_map", stamp_ns=10**9), graph, CONFIG)
    delta = Delta(version=2, cycle=1, phase=Phase.CORRECTION, operations=answer.operations)
    assert graph.apply(delta)
    return graph


def house(label: str = "41a", x_m: float = 10.0, y_m: float = 0.0, **facts: int) -> Object:
    """A house of the root map, by default the one that the first recalled one matches."""
    return landmark(label, [(x_m, y_m)], names={"house": 4.0}, width_m=8.0, **facts)


def node(graph: Graph, label: str) -> Object:
    """An object that is there."""
    found = graph.get(Object, object_id(label))
    assert found is not None
    return found


def test_the_root_map_knows_what_it_is_and_the_recollection_is_gone() -> None:
    graph = joined()
    root = graph.get(Map, ROOT_MAP)

    assert root is not None
    assert root.remembered == "remembered:1"
    assert RECOLLECTION_ID not in graph.nodes


def test_the_agent_stands_where_it_is_on_the_recalled_map() -> None:
    graph = joined()

    assert graph.agent is not None
    assert (graph.agent.x_m, graph.agent.y_m) == pytest.approx((100.0, 0.0))
    assert graph.agent.heading_rad == pytest.approx(QUARTER_RAD)


def test_an_object_known_here_is_the_recalled_one_and_was_seen_as_often_as_both() -> None:
    known = node(joined(house(sightings=5)), "41a")

    assert (known.x_m, known.y_m) == (100.0, 10.0)
    assert known.sightings == 25
    assert known.function == "home"
    assert known.names == {"house": 24.0}


def test_a_recalled_object_that_is_not_known_here_gets_a_label_of_its_own() -> None:
    graph = joined(house(sightings=5), house("30b", -30.0, 5.0, sightings=4))

    recalled = node(graph, "recalled1b")
    assert (recalled.x_m, recalled.y_m, recalled.look) == (60.0, 60.0, "house")
    assert graph.links.target(recalled.id, LinkKind.AT) == "place:map:0:60:60"
    kept = node(graph, "30b")
    assert (kept.x_m, kept.y_m) == pytest.approx((95.0, -30.0))


def test_an_unmatched_object_that_stands_where_one_of_its_look_was_is_the_same() -> None:
    graph = joined(house(sightings=5), house("52b", 58.5, 40.5, sightings=1))

    assert node(graph, "52b").sightings == 13
    assert object_id("recalled1b") not in graph.nodes


def test_an_object_keeps_the_name_that_a_person_gave_it_in_an_earlier_run() -> None:
    assert node(joined(house()), "recalled1b").name == "the mill"
    assert node(joined(house(), house("52b", 58.5, 40.5)), "52b").name == "the mill"


def test_place_nodes_are_as_they_were_learned_with_weights_by_their_evidence() -> None:
    places = joined().places

    assert places.value(ROOT_MAP, 67, -28, PlaceColumn.ROAD) == 0.75
    assert places.value(ROOT_MAP, 67, -28, PlaceColumn.EVIDENCE_E) == -2.5
    assert places.value(ROOT_MAP, 67, -28, PlaceColumn.WEIGHT_E) == 0.0


def test_path_goals_and_the_plan_move_with_the_agent() -> None:
    rows = np.zeros((2, 11))
    rows[1, :2] = (1.0, 5.0)
    graph = joined(
        PathSegment(id="path:0", number=0, rows=Matrix.of(rows)),
        Goal(id=goal_id("there"), x_m=20.0, y_m=0.0),
        Plan(
            id=PLAN_ID,
            state=PlanState.READY,
            planned_ns=5,
            route=Matrix.of([[0.0, 0.0], [20.0, 0.0]]),
        ),
    )

    segment = graph.get(PathSegment, "path:0")
    goal = graph.get(Goal, goal_id("there"))
    plan = graph.get(Plan, PLAN_ID)
    assert segment is not None
    assert goal is not None
    assert plan is not None
    assert plan.route is not None
    assert segment.rows.numpy()[1, 1:4] == pytest.approx((100.0, 5.0, QUARTER_RAD))
    assert (goal.x_m, goal.y_m) == pytest.approx((100.0, 20.0))
    assert plan.route.numpy()[1] == pytest.approx((100.0, 20.0))
    assert plan.planned_ns == 10**9 - 1


def test_a_correction_that_waits_is_applied_first() -> None:
    rows = np.zeros((1, 7))
    graph = graph_of(agent(), recollection())
    waiting = graph_of(agent(), recollection(), Correction(id=CORRECTION_ID, rows=Matrix.of(rows)))
    context = CycleContext(1, percepts(0), Array.of(np.zeros((0, 5))), 1, None)

    assert len(join_map.due(context, graph, CONFIG)) == 1
    assert join_map.due(context, waiting, CONFIG) == []


def test_a_correction_that_was_computed_before_the_map_was_joined_changes_nothing() -> None:
    path = np.zeros((3, 11))
    path[:, 0] = np.arange(3)
    path[:, 1] = 50.0 + np.arange(3)
    rows = np.zeros((3, 7))
    rows[:, 0] = np.arange(3)
    rows[:, 1] = np.arange(3)
    rows[:, 4] = np.arange(3) + 1.0
    graph = graph_of(
        agent(),
        PathSegment(id="path:0", number=0, rows=Matrix.of(path)),
        Correction(id=CORRECTION_ID, rows=Matrix.of(rows)),
    )

    (dropped,) = run(task("apply_correction"), graph, CONFIG).operations

    assert getattr(dropped, "id", "") == CORRECTION_ID


def districts(*sub_maps: SubMap) -> Recollection:
    """The same recollection, with a tree."""
    return msgspec.structs.replace(recollection(), sub_maps=list(sub_maps))


def district(number: int, *members: str) -> SubMap:
    """A sub-map of the recalled map."""
    return SubMap(
        number=number, cell_m=0.5, x_m=80, y_m=35, width_m=40, height_m=50, members=list(members)
    )


def test_recalled_objects_are_in_the_sub_maps_that_they_were_in() -> None:
    graph = joined(districts(district(7, "12a", "30b")), house())

    found = graph.get(Map, map_id(7))
    assert found is not None
    assert (found.parent, found.x_m, found.y_m, found.width_m) == (ROOT_MAP, 80, 35, 40)
    for label in ("41a", "recalled1b"):
        assert graph.links.target(object_id(label), LinkKind.WITHIN) == map_id(7)


def test_sub_maps_of_this_run_make_way_and_keep_what_was_not_recalled() -> None:
    own = Map(id=map_id(7), parent=ROOT_MAP, cell_m=1.0, x_m=10.0, y_m=5.0, width_m=9, height_m=9)
    links = [
        Link(source=object_id(label), target=map_id(7), kind=LinkKind.WITHIN)
        for label in ("41a", "bakery")
    ]
    graph = joined(
        districts(district(7, "12a", "30b")),
        house(),
        landmark("bakery"),
        own,
        *links,
    )

    assert graph.links.sources(map_id(7), LinkKind.WITHIN) == ("object:41a", "object:recalled1b")
    assert graph.links.sources(map_id(8), LinkKind.WITHIN) == ("object:bakery",)
    kept = graph.get(Map, map_id(8))
    assert kept is not None
    assert (kept.x_m, kept.y_m) == pytest.approx((95.0, 10.0))


def test_a_sub_map_whose_objects_were_all_recalled_is_another_or_gone() -> None:
    own = Map(id=map_id(3), parent=ROOT_MAP, cell_m=1.0)
    link = Link(source=object_id("41a"), target=map_id(3), kind=LinkKind.WITHIN)
    graph = joined(districts(district(7, "12a", "30b")), house(), own, link)

    assert graph.get(Map, map_id(3)) is None
    assert graph.links.target(object_id("41a"), LinkKind.WITHIN) == map_id(7)


def test_recalled_sub_maps_keep_their_numbers_when_their_objects_are_sorted_anew() -> None:
    rows = []
    members: dict[int, list[str]] = {5: [], 2: []}
    for number, names in members.items():
        for place in range(12):
            at_m = (1000.0 * number + 12.0 * (place // 2), 12.0 * (place % 2))
            rows.append([*at_m, 0.5, 0.5, 6.0, 5.0, 9.0])
            names.append(f"house-{number}-{place}")

    labels = members[5] + members[2]
    recalled = Recollection(
        id=RECOLLECTION_ID,
        map="remembered:1",
        x_m=0.0,
        y_m=0.0,
        heading_rad=0.0,
        labels=labels,
        names=[""] * len(labels),
        given_names=[""] * len(labels),
        functions=[""] * len(labels),
        matched=[""] * len(labels),
        objects=Matrix.of(rows),
        sub_maps=[district(number, *members[number]) for number in members],
    )
    graph = joined(recalled)

    outdated = [map_id(5), map_id(2)]
    answer = run(task("map_structure", about=outdated), graph, CONFIG)
    graph.change(answer.operations)

    for number in members:
        within = {
            graph.links.target(each.id, LinkKind.WITHIN)
            for each in graph.of_kind(Object)
            if abs(each.x_m - 1000.0 * number) < 500.0
        }
        assert within == {map_id(number)}
