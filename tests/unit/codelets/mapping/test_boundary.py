"""Links that cross kerbs, walls and obstacles are cut, and free again when these are gone."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from benchmarks.explore.boundaries import boundary_score
from cogmap.bus.codec import encode
from cogmap.geometry.se2 import rotate
from cogmap.graph.graph import Graph
from cogmap.graph.window import EVIDENCE_COLUMNS, WEIGHT_COLUMNS
from cogmap.runtime.codelet import CycleContext
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Cells, Operation
from cogmap.schemas.nodes import ROOT_MAP, Map, Misfits, PlaceColumn
from cogmap.schemas.sensing import RangeScan
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.mapping import boundary
from cogmap.testing import graph_of, percepts
from tests.support.world.scenes import run
from tests.support.world.street import Street, View, see, self_at

CONFIG = Config()
HERE = (0.0, 0.0, 0.0)
BOUNDARY = "boundary"
ROAD = "road_place"
MAX_TASK_BYTES = 65_536
AHEAD_M = np.stack(np.meshgrid(np.arange(3.0, 9.0, 0.5), np.arange(-2.0, 2.1, 0.5)), -1)
ALL_ROAD = View(road_m=AHEAD_M)
# Where the road ends, across it, between the place nodes at 5 m and 6 m.
ACROSS_M = [(5.5, y_m) for y_m in np.arange(-2.0, 2.1, 0.5)]
BLOCKED = View(road_m=AHEAD_M, boundary_m=ACROSS_M)
HIT = View(rays=[(0.02, 5.8), (0.0, 5.8), (-0.02, 5.8)])


def _graph(*operations: Operation) -> Graph:
    return graph_of(self_at(HERE), *operations)


def _seen(*views: View, graph: Graph | None = None) -> Graph:
    """The graph after the codelet has seen these views."""
    seen = graph or _graph()
    for view in views:
        see(seen, view, CONFIG, BOUNDARY)
    return seen


def _weight(graph: Graph, i: int, j: int, column: PlaceColumn = PlaceColumn.WEIGHT_E) -> float:
    value = graph.places.value(ROOT_MAP, i, j, column)
    return 1.0 if value is None else value


@pytest.mark.parametrize("turned_rad", [0.0, 0.5])
@pytest.mark.parametrize(("half_m", "wall_m"), [(4.0, 7.0), (2.6, 4.3)])
def test_links_are_cut_at_kerbs_and_walls_and_nowhere_else(
    half_m: float, wall_m: float, turned_rad: float
) -> None:
    street = Street(half_m, wall_m, range_sd=0.03, view_sd_m=0.1)
    graph = graph_of()
    for x_m in np.arange(0.0, 30.0, 0.5):
        heading_rad = 0.1 * math.sin(x_m / 3)
        pose = np.array([x_m, -1.5, heading_rad])
        on_map_m = rotate(pose[:2], turned_rad)
        graph.change([self_at((*on_map_m, heading_rad + turned_rad), sd_m=0.2)])
        see(graph, street.view(pose), CONFIG, BOUNDARY, ROAD)

    window = graph.places.window(ROOT_MAP, [*WEIGHT_COLUMNS, *EVIDENCE_COLUMNS])
    ends_m = street.boundaries_m(30.0).reshape(-1, 2, 2)
    boundaries_m = rotate(ends_m, turned_rad).reshape(-1, 4)
    score = boundary_score(window, 1.0, boundaries_m)
    assert score.crossed > 200
    assert score.precision >= 0.95
    assert score.recall >= 0.9


def test_one_mistaken_sighting_cuts_nothing_and_is_forgotten() -> None:
    once = _seen(BLOCKED)
    assert 0.2 < _weight(once, 5, 0) < 1.0

    forgotten = _seen(ALL_ROAD, ALL_ROAD, graph=once)
    assert _weight(forgotten, 5, 0) == 1.0


def test_a_link_that_was_long_free_is_cut_after_a_few_agreeing_views() -> None:
    long_free = _seen(*[ALL_ROAD] * 50)
    assert _weight(_seen(BLOCKED, graph=long_free), 5, 0) == 1.0

    blocked = _seen(*[BLOCKED] * 6, graph=long_free)
    assert _weight(blocked, 5, 0) == 0.0
    assert _weight(blocked, 5, 0, PlaceColumn.WEIGHT_NE) == 0.0
    assert _weight(blocked, 4, 0) == 1.0
    assert _weight(blocked, 5, 0, PlaceColumn.WEIGHT_N) == 1.0


def test_what_was_long_blocked_is_free_after_a_few_views_of_the_road() -> None:
    long_blocked = _seen(*[BLOCKED] * 50)
    assert _weight(long_blocked, 5, 0) == 0.0

    assert _weight(_seen(*[ALL_ROAD] * 8, graph=long_blocked), 5, 0) == 1.0


def test_a_point_alone_where_the_road_seems_to_end_is_taken_for_a_mistake() -> None:
    graph = _seen(*[View(boundary_m=[(5.5, 0.0)])] * 5)

    assert not list(graph.places.of_map(ROOT_MAP))


def test_a_ray_passes_over_a_kerb_and_does_not_free_its_links() -> None:
    kerb_m = [(x_m, 1.5) for x_m in np.arange(3.0, 9.0, 0.5)]
    street_m = [point for point in AHEAD_M.reshape(-1, 2).tolist() if point[1] < 1.2]
    cut = graph_of(self_at(HERE))
    for _ in range(4):
        see(cut, View(street_m, kerb_m), CONFIG, BOUNDARY, ROAD)
    assert _weight(cut, 6, 1, PlaceColumn.WEIGHT_N) == 0.0

    rays = [(bearing_rad, 14.0) for bearing_rad in np.linspace(-0.6, 0.6, 60)]
    for _ in range(20):
        see(cut, View(street_m, rays=rays), CONFIG, BOUNDARY, ROAD)
    assert _weight(cut, 6, 1, PlaceColumn.WEIGHT_N) == 0.0


def test_what_is_hit_cuts_the_links_to_it_and_is_an_obstacle() -> None:
    graph = _seen(*[HIT] * 4)

    assert _weight(graph, 5, 0) == 0.0
    assert _weight(graph, 4, 0) == 1.0
    place = graph.place(6, 0)
    assert place is not None
    assert place.obstacle > 0.8


def test_an_obstacle_that_is_gone_is_withdrawn_and_its_links_are_free() -> None:
    graph = _seen(*[HIT] * 20)
    through = View(rays=[(0.02, 12.0), (0.0, 12.0), (-0.02, 12.0)])
    _seen(*[through] * 20, graph=graph)

    place = graph.place(6, 0)
    assert place is not None
    assert place.obstacle == 0.0
    assert _weight(graph, 5, 0) == 1.0


def test_what_stereo_finds_before_road_that_is_seen_is_no_obstacle() -> None:
    rays = [(bearing_rad, 5.8) for bearing_rad in np.linspace(-0.3, 0.3, 15)]
    road_beyond = View(road_m=AHEAD_M, rays=rays)
    road_before = View(road_m=AHEAD_M[AHEAD_M[..., 0] < 5.8], rays=rays)

    graph = _seen(*[road_beyond] * 4)
    assert _weight(graph, 5, 0) == 1.0
    assert _weight(_seen(*[road_before] * 4), 5, 0) == 0.0


def test_what_is_far_or_seen_from_an_unsure_pose_counts_less() -> None:
    far_m = [(x_m + 6.0, y_m) for x_m, y_m in ACROSS_M]
    near = _seen(BLOCKED)
    far = _seen(View(boundary_m=far_m))
    unsure = graph_of(self_at(HERE, sd_m=2.0))
    _seen(BLOCKED, graph=unsure)

    assert _weight(near, 5, 0) < _weight(far, 11, 0) < 1.0
    assert _weight(near, 5, 0) < _weight(unsure, 5, 0) < 1.0


def test_what_lies_beyond_reach_is_not_believed() -> None:
    beyond_m = [(x_m + boundary.REACH_M, y_m) for x_m, y_m in ACROSS_M]
    graph = _seen(View(boundary_m=beyond_m))

    assert not list(graph.places.of_map(ROOT_MAP))


def test_views_that_change_nothing_any_more_write_nothing() -> None:
    street = Street(4.0, 7.0)
    graph = _graph()
    view = street.view(HERE)
    first = see(graph, view, CONFIG, BOUNDARY)
    for _ in range(40):
        last = see(graph, view, CONFIG, BOUNDARY)

    assert first > 500
    assert last == 0


def test_an_agent_that_is_lost_cuts_nothing() -> None:
    lost = graph_of(msgspec.structs.replace(self_at(HERE), misfits=Misfits(is_lost=True)))

    assert not run(BLOCKED.task(BOUNDARY), lost, CONFIG).operations


def test_evidence_is_of_the_map_that_the_agent_is_on() -> None:
    hall = Map(id="map:hall", cell_m=0.5, parent=ROOT_MAP)
    inside = msgspec.structs.replace(self_at(HERE), map="map:hall")
    graph = graph_of(hall, inside)
    _seen(*[BLOCKED] * 4, graph=graph)

    between = graph.places.value("map:hall", 10, 0, PlaceColumn.WEIGHT_E)
    beyond = graph.places.value("map:hall", 11, 0, PlaceColumn.WEIGHT_E)
    assert {between, beyond} == {0.0, 1.0} or between == 0.0
    assert not list(graph.places.of_map(ROOT_MAP))


def _context(view: View) -> CycleContext:
    rays = np.asarray(view.rays, np.float32).reshape(-1, 2)
    boundary_m = np.asarray(view.boundary_m, np.float32).reshape(-1, 2)
    road_m = np.asarray(view.road_m, np.float32).reshape(-1, 2)
    seen = msgspec.structs.replace(
        percepts(0), road_m=Array.of(road_m), road_boundary_m=Array.of(boundary_m)
    )
    bearing_rad, range_m = np.ascontiguousarray(rays.T)
    scan = RangeScan(frame=0, bearing_rad=Array.of(bearing_rad), range_m=Array.of(range_m))
    motions = Array.of(np.zeros((0, 5)))
    return CycleContext(1, seen, motions, 1, scan)


def test_a_view_without_ends_of_road_or_rays_gives_no_task() -> None:
    assert boundary.due(_context(ALL_ROAD), _graph(), CONFIG) == []
    assert len(boundary.due(_context(BLOCKED), _graph(), CONFIG)) == 1
    assert len(boundary.due(_context(HIT), _graph(), CONFIG)) == 1


def test_the_task_of_a_full_view_is_small() -> None:
    street = Street(8.0, 12.0)
    (asked,) = boundary.due(_context(street.view(HERE)), _graph(), CONFIG)

    assert len(encode(asked)) < MAX_TASK_BYTES / 4


def test_the_cells_that_are_written_lie_within_reach() -> None:
    street = Street(4.0, 7.0)
    operations = run(street.view(HERE).task(BOUNDARY), _graph(), CONFIG).operations

    assert operations
    for operation in operations:
        assert isinstance(operation, Cells)
        farthest = np.abs(operation.cells.numpy()).max()
        assert farthest <= boundary.REACH_M + 2
