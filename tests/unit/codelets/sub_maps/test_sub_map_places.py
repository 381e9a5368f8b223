"""The places of sub-maps: on their own grids, around the agent and block by block."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.graph.window import Extent
from cogmap.runtime.codelet import CycleContext, NoSettings
from cogmap.schemas.array import Array
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Cells, Operation
from cogmap.schemas.nodes import ROOT_MAP, Map, PlaceColumn, map_id
from cogmap.services.codelets.sub_maps.resampling import COLUMNS
from cogmap.services.codelets.sub_maps.sub_map_grid import BLOCK, SETTLED_CYCLES
from cogmap.services.codelets.sub_maps.sub_map_places import EVERY_CYCLES, due, make_all, run
from cogmap.testing import agent, graph_of, percepts, task

CONFIG = NoSettings()
SETTLED = 1000
HERE, FAR = map_id(1), map_id(2)


def _road(i: tuple[int, int], j: tuple[int, int], value: float = 1.0) -> Cells:
    """Road in a rectangle of the root map's cells: from and to i, from and to j."""
    grid = np.mgrid[i[0] : i[1] + 1, j[0] : j[1] + 1]
    cells = grid.reshape(2, -1).T
    values = np.full(len(cells), value, np.float32)
    return Cells(column=PlaceColumn.ROAD, cells=Array.of(cells, "<i4"), values=Array.of(values))


def _map(identifier: str = HERE, **facts: float) -> Map:
    usual = {"cell_m": 2.0, "width_m": 40.0, "height_m": 20.0}
    return Map(id=identifier, parent=ROOT_MAP, **(usual | facts))


def _task(number: int = 0) -> Task:
    cycle = SETTLED + number * EVERY_CYCLES
    return msgspec.structs.replace(task("sub_map_places"), cycle=cycle)


def _updated(*operations: Operation, updates: int = 1) -> Graph:
    """The graph after so many updates."""
    graph = graph_of(agent(), *operations)
    for number in range(updates):
        graph.change(run(_task(number), graph, CONFIG).operations)
    return graph


def _value(
    graph: Graph, i: int, j: int, map_id: str = HERE, column: PlaceColumn = PlaceColumn.ROAD
) -> float | None:
    return graph.places.value(map_id, i, j, column)


def _all(graph: Graph, map_id: str = HERE) -> np.ndarray:
    return graph.places.window(map_id, COLUMNS, Extent((-32, -32), (32, 32))).values


def test_a_sub_map_has_places_in_its_own_frame_at_its_own_distance() -> None:
    graph = _updated(_map(x_m=10.0, y_m=4.0), _road((14, 14), (0, 0), 0.8))

    assert _value(graph, 2, -2) == np.float32(0.8)
    place = graph.place(2, -2, HERE)
    assert place is not None
    assert (place.x_m, place.y_m) == (4.0, -4.0)
    assert (_all(graph)[0] > 0).sum() == 1


def test_places_reach_as_far_as_the_area_of_the_sub_map() -> None:
    graph = _updated(_map(), _road((-25, 25), (-25, 25)))

    i, j = np.nonzero(_all(graph)[0])
    assert (i.min() - 32, i.max() - 32) == (-10, 10)
    assert (j.min() - 32, j.max() - 32) == (-5, 5)


def test_places_of_a_sub_map_that_was_moved_and_turned_stay_where_they_are_in_it() -> None:
    straight = _updated(_map(), _road((8, 8), (0, 0)))
    node = _map(x_m=5.0, heading_rad=np.pi / 2)
    turned = _updated(node, _road((5, 5), (8, 8)))

    assert _value(straight, 4, 0) == 1.0
    np.testing.assert_array_equal(_all(turned)[0], _all(straight)[0])


def test_what_has_changed_around_the_agent_is_up_to_date_at_once() -> None:
    graph = _updated(_map(), _map(FAR, x_m=500.0), updates=1)
    graph.change([_road((6, 6), (0, 0))])
    odd = next(number for number in range(2) if _task(number).cycle // EVERY_CYCLES % 2)
    graph.change(run(_task(odd), graph, CONFIG).operations)

    assert _value(graph, 3, 0) == 1.0


def test_what_is_far_from_the_agent_is_reached_block_by_block() -> None:
    wide = _map(FAR, x_m=500.0, width_m=2 * BLOCK, height_m=2 * BLOCK)
    road = _road((500 - BLOCK, 500 + BLOCK), (-BLOCK, BLOCK))
    once = _updated(wide, road)
    often = _updated(wide, road, updates=9)
    at_once = graph_of(agent(), wide, road)
    make_all(at_once, SETTLED)

    assert 0 < (_all(once, FAR)[0] > 0).sum() < (_all(often, FAR)[0] > 0).sum()
    np.testing.assert_array_equal(_all(often, FAR), _all(at_once, FAR))


def test_of_many_sub_maps_one_that_has_just_settled_gets_its_places_first() -> None:
    others = [_map(map_id(10 + number), x_m=2e3 + 50 * number) for number in range(40)]
    new = _map(FAR, x_m=500.0, cycle=SETTLED - SETTLED_CYCLES)
    graph = _updated(*others, new, _road((500, 500), (0, 0)))

    assert _value(graph, 0, 0, FAR) == 1.0


def test_a_sub_map_has_no_places_before_its_frame_has_settled() -> None:
    road = _road((-5, 5), (0, 0))
    young = _updated(_map(cycle=SETTLED - SETTLED_CYCLES + 1), road)
    settled = _updated(_map(cycle=SETTLED - SETTLED_CYCLES), road)

    assert _value(young, 0, 0) is None
    assert _value(settled, 0, 0) == 1.0


@pytest.mark.parametrize("cell_m", [0.5, 17.0])
def test_a_grid_that_is_finer_than_the_root_map_or_far_too_coarse_is_left_alone(
    cell_m: float,
) -> None:
    graph = _updated(_map(cell_m=cell_m), _road((-5, 5), (0, 0)))

    assert graph.places.extent(HERE).shape == (0, 0)


def test_nothing_is_written_where_nothing_has_changed() -> None:
    graph = _updated(_map(), _road((0, 10), (0, 10)))

    assert run(_task(), graph, CONFIG).operations == []


def test_a_task_is_due_once_in_a_while_where_a_sub_map_has_settled() -> None:
    def cycles(*nodes: Map) -> list[int]:
        graph = graph_of(agent(), *nodes)
        contexts = (
            CycleContext(cycle, percepts(1), Array.of(np.zeros((0, 5))), graph.version)
            for cycle in range(SETTLED, SETTLED + 2 * EVERY_CYCLES)
        )
        return [context.cycle for context in contexts if due(context, graph, CONFIG)]

    first, second = cycles(_map())
    assert second - first == EVERY_CYCLES
    assert cycles() == cycles(_map(cycle=SETTLED)) == []
