"""Place nodes under the agent and under the road that it sees."""

from __future__ import annotations

import math

import numpy as np
import pytest

from schemas.array import Array
from schemas.graph import Cells
from schemas.nodes import PlaceColumn, Self
from services.codelets.config import Config
from services.codelets.mapping.road_place import ROAD_REACH_M
from tests.support.world.scenes import agent, graph_of, run, task

CONFIG = Config()
AHEAD = (4.0, 0.0)


def _self(x_m: float, y_m: float, heading_rad: float) -> Self:
    samples = np.tile((x_m, y_m, heading_rad), (50, 1))
    return agent(samples, x_m=x_m, y_m=y_m, heading_rad=heading_rad)


def _road(
    node: Self, *points_m: tuple[float, float], cell_m: float = 1.0
) -> dict[tuple[int, int], float]:
    """The road that is marked, by cell, where these points ahead of the agent are road."""
    road_m = Array.of(np.array(points_m, np.float32))
    graph = graph_of(node, cell_m=cell_m)
    _, road = run(task("road_place", road_m=road_m), graph, CONFIG).operations
    assert isinstance(road, Cells)
    assert road.column is PlaceColumn.ROAD

    cells = road.cells.numpy().tolist()
    values = road.values.numpy().tolist()
    return {(i, j): value for (i, j), value in zip(cells, values, strict=True)}


def test_road_is_marked_on_the_place_nodes_where_it_is_seen_from_the_pose() -> None:
    facing_north = _self(10.0, 20.0, math.pi / 2)
    aside = (4.0, 2.0)
    road = _road(facing_north, AHEAD, AHEAD, AHEAD, aside)

    assert road == {(10, 24): 1.0, (8, 24): pytest.approx(1 / 3)}


def test_a_coarser_grid_gets_the_same_road_on_fewer_nodes() -> None:
    at_origin = _self(0.0, 0.0, 0.0)
    road = _road(at_origin, AHEAD, (4.6, 0.4), (8.0, 0.0), cell_m=4.0)

    assert sorted(road) == [(1, 0), (2, 0)]


def test_road_seen_from_afar_is_not_believed() -> None:
    at_origin = _self(0.0, 0.0, 0.0)
    too_far = (ROAD_REACH_M + 1, 0.0)
    road = _road(at_origin, (2.0, 0.0), too_far)

    assert list(road) == [(2, 0)]


def test_the_place_node_under_the_agent_is_active_even_without_road_in_view() -> None:
    graph = graph_of(_self(-3.4, 2.6, 0.0))
    (here,) = run(task("road_place"), graph, CONFIG).operations

    assert isinstance(here, Cells)
    assert here.column is PlaceColumn.ACTIVATION
    assert here.cells.numpy().tolist() == [[-3, 3]]
    assert here.values.numpy().tolist() == [1.0]
