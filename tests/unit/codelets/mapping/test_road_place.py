"""Place nodes under the agent and under the road that it sees."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.schemas.graph import Cells
from cogmap.schemas.nodes import ROOT_MAP, Misfits, PlaceColumn
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.mapping.road_place import ROAD_REACH_M
from cogmap.testing import graph_of, task
from tests.support.world.scenes import run
from tests.support.world.street import View, see, self_at

CONFIG = Config()
ORIGIN = (0.0, 0.0, 0.0)
ROAD = "road_place"
AHEAD = (4.0, 0.0)
BESIDE = (4.0, 1.0)
RAYS = tuple((bearing_rad, 14.0) for bearing_rad in np.linspace(-0.6, 0.6, 40).tolist())
SURE = View([AHEAD] * 3)
OTHER_GROUND = View([BESIDE] * 3, rays=RAYS)


def _road(graph: Graph) -> dict[tuple[int, int], float]:
    """How much place nodes are road, by cell."""
    cells, shares = graph.places.written_cells(ROOT_MAP, PlaceColumn.ROAD)
    return {(i, j): share for (i, j), share in zip(cells.tolist(), shares.tolist(), strict=True)}


def _seen(*views: View, graph: Graph | None = None) -> Graph:
    seen = graph or graph_of(self_at(ORIGIN))
    for view in views:
        see(seen, view, CONFIG, ROAD)
    return seen


def test_road_is_marked_on_the_place_nodes_where_it_is_seen_from_the_pose() -> None:
    facing_north = graph_of(self_at((10.0, 20.0, math.pi / 2)))
    aside = (4.0, 2.0)
    road = _road(_seen(*[View([AHEAD, AHEAD, AHEAD, aside])] * 12, graph=facing_north))

    assert road == {
        (10, 24): pytest.approx(1.0, abs=0.05),
        (8, 24): pytest.approx(1 / 3, abs=0.05),
    }


def test_a_coarser_grid_gets_the_same_road_on_fewer_nodes() -> None:
    coarse = graph_of(self_at(ORIGIN), cell_m=4.0)
    road = _road(_seen(View([AHEAD, (4.6, 0.4), (8.0, 0.0)]), graph=coarse))

    assert sorted(road) == [(1, 0), (2, 0)]


def test_road_seen_from_afar_is_not_believed() -> None:
    too_far = (ROAD_REACH_M + 1, 0.0)
    road = _road(_seen(View([(2.0, 0.0), too_far])))

    assert list(road) == [(2, 0)]


def test_one_sighting_does_not_make_a_place_node_road_but_two_do() -> None:
    once = _seen(SURE)
    assert _road(once)[4, 0] < 0.5

    assert _road(_seen(SURE, graph=once))[4, 0] > 0.5


def test_road_is_withdrawn_where_later_views_show_other_ground() -> None:
    long_road = _seen(*[SURE] * 50)
    doubted = _road(_seen(OTHER_GROUND, graph=long_road))
    assert 0.5 < doubted[4, 0] < 1.0

    withdrawn = _road(_seen(*[OTHER_GROUND] * 6, graph=long_road))
    assert (4, 0) not in withdrawn
    assert withdrawn[4, 1] > 0.9


def test_road_stays_where_nothing_is_seen_of_its_ground() -> None:
    hidden = View([BESIDE] * 3, rays=[(bearing_rad, 2.0) for bearing_rad, _ in RAYS])
    unlit = View(rays=RAYS)
    without_scan = View([BESIDE] * 3)
    graph = _seen(*[SURE] * 5)
    known = _road(graph)[4, 0]

    assert _road(_seen(hidden, unlit, without_scan, graph=graph))[4, 0] == known


def test_an_agent_that_is_lost_marks_no_road() -> None:
    lost = graph_of(msgspec.structs.replace(self_at(ORIGIN), misfits=Misfits(is_lost=True)))

    assert not _road(_seen(SURE, graph=lost))


def test_the_place_node_under_the_agent_is_active_even_without_road_in_view() -> None:
    graph = graph_of(self_at((-3.4, 2.6, 0.0)))
    (here,) = run(task(ROAD), graph, CONFIG).operations

    assert isinstance(here, Cells)
    assert here.column is PlaceColumn.ACTIVATION
    assert here.cells.numpy().tolist() == [[-3, 3]]
    assert here.values.numpy().tolist() == [1.0]
