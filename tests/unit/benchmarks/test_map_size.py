"""The benchmark of map size, on maps that are small enough for a test."""

from __future__ import annotations

from benchmarks.map_size import cycles
from benchmarks.map_size.join import join, replica_memory_mb
from benchmarks.map_size.maps import Size, cognitive_map
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import TILE_SIDE, LinkKind, Object, PlaceColumn

TINY = Size(objects=5, places=2_000)


def test_a_made_up_map_has_the_objects_and_places_it_should() -> None:
    graph = Graph()
    graph.load(cognitive_map(TINY))
    objects = list(graph.of_kind(Object))
    tiles = list(graph.places.tiles.values())

    assert len(objects) == graph.count(Object) == 5
    assert all(graph.links.target(node.id, LinkKind.AT) for node in objects)
    assert len(tiles) * TILE_SIDE**2 >= 2_000
    assert set(tiles[0].columns) == set(PlaceColumn)


def test_every_cycle_is_measured_and_the_learned_map_stays() -> None:
    measured = cycles.drive(cognitive_map(TINY))

    assert measured.cycles == cycles.CYCLES
    assert measured.mean_cpu_s > 0
    assert measured.mean_delta_bytes > 0
    assert 0 < measured.task_bytes_p99 < 65536


def test_a_worker_that_joins_is_timed_until_its_first_proposal() -> None:
    joined = join(cognitive_map(TINY))

    assert joined.join_s > 0


def test_the_memory_of_a_replica_grows_with_its_map() -> None:
    small = replica_memory_mb(cognitive_map(TINY))
    large = replica_memory_mb(cognitive_map(Size(objects=5_000, places=50_000)))

    assert large > small + 5


def test_a_map_may_have_place_nodes_and_no_objects() -> None:
    graph = Graph()
    graph.load(cognitive_map(Size(objects=0, places=1024)))

    assert graph.count(Object) == 0
    assert len(graph.places.tiles) >= 1
