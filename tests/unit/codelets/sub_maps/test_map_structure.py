"""The map structure codelet: sub-maps of the objects on the map."""

import msgspec
import numpy as np
import pytest

from cogmap.runtime.codelet import CycleContext
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Cells, Delta, DropNode, Links, Phase
from cogmap.schemas.nodes import ROOT_MAP, LinkKind, Map, Object, PlaceColumn, map_id
from cogmap.services.codelets.config import Config as WorkerConfig
from cogmap.services.codelets.sub_maps.config import Config
from cogmap.services.codelets.sub_maps.map_structure import ALL_ANEW_FROM, due
from cogmap.testing import graph_of, landmark, percept, percepts, task
from tests.support.world.scenes import run

CONFIG = Config()
SPACING_M = 12.0


def row_of(prefix, count, x_m=0.0, rows=2, **facts):
    """Objects in rows along a street."""
    found = []
    for index in range(count):
        position_m = (x_m + SPACING_M * (index // rows), SPACING_M * (index % rows))
        label = f"{prefix}-{index:03d}"
        usual = {"sightings": 3, "width_m": 6.0}
        found.append(landmark(label, [position_m], **(usual | facts)))

    return found


def commit(graph, operations):
    cycle = graph.cycle + 1
    delta = Delta(
        version=graph.version + 1, cycle=cycle, phase=Phase.BACKGROUND, operations=operations
    )
    assert graph.apply(delta)


def structured(graph, about=()):
    """Run the codelet on the graph, and commit its answer; the operations."""
    operations = run(task("map_structure", about=list(about)), graph, WorkerConfig()).operations
    commit(graph, operations)
    return operations


def sub_maps(graph):
    return [node for node in graph.of_kind(Map) if node.parent == ROOT_MAP]


def map_of(graph, node):
    return graph.links.target(node.id, LinkKind.WITHIN)


def context(graph, *labels, cycle=0):
    seen = [percept(label) for label in labels]
    return CycleContext(cycle, percepts(1, *seen), Array.of(np.zeros((0, 5))), graph.version)


def cut_west_of(i, j_from=-30, j_to=90):
    """Place nodes whose links to the west are cut, along a line."""
    cut = []
    of_links = [(PlaceColumn.WEIGHT_E, -1), (PlaceColumn.WEIGHT_NE, -1), (PlaceColumn.WEIGHT_NW, 0)]
    for column, step in of_links:
        cells = np.array([(i + step, j) for j in range(j_from, j_to)], np.int32)
        zeros = np.zeros(len(cells), np.float32)
        cut.append(Cells(column=column, cells=Array.of(cells), values=Array.of(zeros)))

    return cut


def test_objects_get_a_sub_map_with_its_frame_its_extent_and_their_links():
    objects = row_of("house", 12)
    graph = graph_of(*objects)

    structured(graph)

    (found,) = sub_maps(graph)
    assert found.id == map_id(1)
    assert (found.x_m, found.y_m) == (30.0, 6.0)
    assert (found.width_m, found.height_m) == (60.0, 12.0)
    assert {map_of(graph, node) for node in objects} == {found.id}


def test_districts_far_apart_get_sub_maps_of_their_own():
    near = row_of("near", 12)
    far = row_of("far", 12, x_m=900)
    graph = graph_of(*near, *far)

    structured(graph)

    assert len(sub_maps(graph)) == 2
    assert len({map_of(graph, node) for node in near}) == 1
    assert map_of(graph, near[0]) != map_of(graph, far[0])


def test_links_of_place_nodes_that_are_cut_part_objects():
    objects = row_of("house", 72, rows=6)
    wall = cut_west_of(67)

    apart = graph_of(*objects, *wall)
    structured(apart)
    together = graph_of(*objects)
    structured(together)

    assert len(sub_maps(apart)) == 2
    assert len(sub_maps(together)) == 1


def test_objects_of_other_functions_get_a_sub_map_of_their_own():
    shops = row_of("shop", 24, function="shop")
    homes = row_of("home", 24, x_m=144, function="home")
    graph = graph_of(*shops, *homes)

    structured(graph)

    assert len(sub_maps(graph)) == 2
    assert len({map_of(graph, node) for node in shops}) == 1


def test_a_small_sub_map_is_as_fine_as_the_root_map_and_a_large_one_coarser():
    small = row_of("small", 6)
    large = [
        landmark(f"large-{i}-{j}", [(1000 + 40.0 * i, 40.0 * j)], sightings=3)
        for i in range(8)
        for j in range(8)
    ]
    graph = graph_of(*small, *large)

    structured(graph)

    cells_m = {graph.cell_m(map_of(graph, node)) for node in (small[0], large[0])}
    assert graph.cell_m(map_of(graph, small[0])) == min(cells_m) == 1.0
    assert graph.cell_m(map_of(graph, large[0])) == max(cells_m) > 1.0


def test_an_object_in_view_that_is_in_no_sub_map_is_what_a_task_is_about():
    objects = row_of("house", 12)
    graph = graph_of(*objects)
    structured(graph)
    late = landmark("late", [(18.0, 6.0)], sightings=2)
    commit(graph, [late])

    (asked,) = due(context(graph, "house-003", "late"), graph, CONFIG)

    assert asked.about == [late.id]
    structured(graph, asked.about)
    assert map_of(graph, late) == map_id(1)
    assert not due(context(graph, "house-003", "late"), graph, CONFIG)


def test_an_object_whose_sub_map_is_gone_is_in_none():
    node = landmark("house", sightings=3)
    graph = graph_of(node, Links(kind=LinkKind.WITHIN, weights={node.id: {map_id(4): 1.0}}))

    (found,) = due(context(graph, "house"), graph, CONFIG)

    assert found.about == [node.id]


def test_an_object_seen_only_once_waits():
    graph = graph_of(landmark("house", [(0.0, 0.0)], sightings=1))

    assert not due(context(graph, "house"), graph, CONFIG)


def test_an_object_that_was_given_need_not_be_seen():
    graph = graph_of(landmark("house", [(0.0, 0.0)], sightings=0, surveyed=True))

    assert due(context(graph, "house"), graph, CONFIG)


def test_many_objects_that_come_at_once_are_all_sorted():
    graph = graph_of(*row_of("given", ALL_ANEW_FROM + 1, sightings=0))

    (asked,) = due(context(graph), graph, CONFIG)

    assert not asked.about
    structured(graph)
    assert not due(context(graph), graph, CONFIG)


def test_an_object_that_arrives_changes_no_sub_map_out_of_its_reach():
    near = row_of("near", 12)
    far = row_of("far", 12, x_m=900)
    graph = graph_of(*near, *far)
    structured(graph)
    late = landmark("late", [(18.0, 6.0)], sightings=2)
    commit(graph, [late])

    operations = structured(graph, [late.id])

    assert operations == [Links(kind=LinkKind.WITHIN, weights={late.id: {map_id(2): 1.0}})] or (
        operations == [Links(kind=LinkKind.WITHIN, weights={late.id: {map_id(1): 1.0}})]
    )


def test_a_sub_map_follows_its_objects_when_the_map_is_corrected():
    objects = row_of("house", 12)
    graph = graph_of(*objects)
    structured(graph)
    moved = [msgspec.structs.replace(node, x_m=node.x_m + 20) for node in objects]
    commit(graph, moved)

    (asked,) = due(context(graph), graph, CONFIG)
    structured(graph, asked.about)

    (found,) = sub_maps(graph)
    assert found.id == map_id(1)
    assert found.x_m == 50.0
    assert not due(context(graph), graph, CONFIG)


def test_a_sub_map_whose_objects_are_forgotten_is_dropped():
    objects = row_of("house", 12)
    graph = graph_of(*objects)
    structured(graph)
    commit(graph, [DropNode(id=node.id) for node in objects])

    (asked,) = due(context(graph), graph, CONFIG)
    operations = structured(graph, asked.about)

    assert operations == [DropNode(id=map_id(1))]
    assert not sub_maps(graph)


def test_sub_maps_that_merge_keep_one_and_drop_the_other():
    left = row_of("left", 12)
    right = row_of("right", 12, x_m=20 * SPACING_M)
    graph = graph_of(*left, *right)
    structured(graph)
    assert len(sub_maps(graph)) == 2
    between = row_of("between", 28, x_m=6 * SPACING_M)
    commit(graph, between)

    for node in between:
        structured(graph, [node.id])

    (found,) = sub_maps(graph)
    assert found.id in (map_id(1), map_id(2))
    assert {map_of(graph, node) for node in (*left, *between, *right)} == {found.id}


def test_a_number_is_not_given_to_two_sub_maps():
    near = row_of("near", 12)
    graph = graph_of(*near, Map(id=map_id(7), cell_m=1.0))
    structured(graph)

    assert map_of(graph, near[0]) == map_id(8)


@pytest.mark.parametrize("order", [1, -1])
def test_the_answer_does_not_depend_on_the_order_in_which_objects_came(order):
    objects = [*row_of("a", 12), *row_of("b", 12, x_m=900)]
    graph = graph_of(*objects[::order])

    operations = run(task("map_structure"), graph, WorkerConfig()).operations

    same = graph_of(*objects)
    assert operations == run(task("map_structure"), same, WorkerConfig()).operations


def test_objects_of_another_map_are_left_alone():
    elsewhere = [msgspec.structs.replace(node, map=map_id(3)) for node in row_of("house", 12)]
    graph = graph_of(Map(id=map_id(3), cell_m=1.0), *elsewhere)

    assert structured(graph) == []
    assert all(isinstance(node, Object) for node in elsewhere)


def with_places(graph, node):
    """Place nodes of the sub-map of an object."""
    cells = Array.of(np.array([[0, 0]]), "<i4")
    values = Array.of(np.ones(1, np.float32))
    own = Cells(map=map_of(graph, node), column=PlaceColumn.ROAD, cells=cells, values=values)
    commit(graph, [own])
    return own.map


def test_a_sub_map_that_gets_another_frame_loses_the_places_that_were_in_the_one_before():
    objects = row_of("house", 12)
    graph = graph_of(*objects)
    structured(graph)
    number = with_places(graph, objects[0])

    new = landmark("new", [(72.0, 0.0)], sightings=3, width_m=6.0)
    commit(graph, [new])
    structured(graph, [new.id])

    assert map_of(graph, new) == number
    assert graph.get(Map, number).x_m > 30.0
    assert graph.place(0, 0, number) is None


def test_a_sub_map_whose_frame_stays_keeps_its_places():
    objects = row_of("house", 12)
    graph = graph_of(*objects)
    structured(graph)
    number = with_places(graph, objects[0])

    new = landmark("new", [(18.0, 6.0)], sightings=3, width_m=6.0)
    commit(graph, [new])
    structured(graph, [new.id])

    assert map_of(graph, new) == number
    assert graph.place(0, 0, number) is not None
