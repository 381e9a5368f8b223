"""Place nodes in bulk."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Decay, DropNode, DropPlaces, Operation, PlaceTile
from cogmap.schemas.nodes import ROOT_MAP, TILE_SIDE, Map, PlaceColumn
from cogmap.testing import cells, graph_of


def _weights(graph: Graph, i: int, j: int) -> dict[str, float]:
    """The links of a place node, by target."""
    return {link.target: link.weight for link in graph.place_links(i, j)}


def test_a_tile_comes_into_being_with_its_first_cell() -> None:
    graph = graph_of(cells(PlaceColumn.ROAD, {(-1, TILE_SIDE): 0.5}))
    assert list(graph.places.tiles) == [(ROOT_MAP, -1, 1)]
    assert graph.place(0, 0) is None

    written = graph.place(-1, TILE_SIDE)
    beside = graph.place(-2, TILE_SIDE)
    assert written is not None
    assert beside is not None
    assert (written.road, beside.road) == (0.5, 0.0)


def test_a_graph_without_place_nodes_follows_all_else() -> None:
    whole = graph_of(
        Map(id=ROOT_MAP, cell_m=2.0),
        cells(PlaceColumn.ROAD, {(2, 3): 1.0}),
        cells(PlaceColumn.OBSTACLE, {(0, 0): 1.0}),
    )
    without = Graph(with_places=False)
    without.load(whole.snapshot())
    without.change([cells(PlaceColumn.ROAD, {(2, 4): 1.0})])

    assert whole.place(2, 3) is not None
    assert not without.places.tiles
    assert without.cell_m() == 2.0


def test_maps_have_place_nodes_of_their_own() -> None:
    coarse = Map(id="map:1", cell_m=4.0, parent=ROOT_MAP)
    graph = graph_of(coarse, cells(PlaceColumn.ROAD, {(2, 3): 1.0}, "map:1"))
    place = graph.place(2, 3, "map:1")

    assert place is not None
    assert (place.id, place.x_m, place.y_m) == ("place:map:1:2:3", 8.0, 12.0)
    assert graph.place(2, 3) is None


@pytest.mark.parametrize("drop", [DropNode(id="map:1"), DropPlaces(map="map:1")])
def test_place_nodes_of_a_map_are_forgotten_with_it_or_alone(drop: Operation) -> None:
    coarse = Map(id="map:1", cell_m=4.0, parent=ROOT_MAP)
    own = cells(PlaceColumn.ROAD, {(2, 3): 1.0}, "map:1")
    graph = graph_of(coarse, own, cells(PlaceColumn.ROAD, {(2, 3): 1.0}), drop)

    assert graph.place(2, 3, "map:1") is None
    assert graph.place(2, 3) is not None
    assert (graph.get(Map, "map:1") is None) == isinstance(drop, DropNode)


def test_a_snapshot_keeps_the_place_nodes_of_each_map_apart() -> None:
    graph = graph_of(
        Map(id="map:1", cell_m=4.0, parent=ROOT_MAP),
        cells(PlaceColumn.ROAD, {(2, 3): 1.0}),
        cells(PlaceColumn.OBSTACLE, {(2, 3): 0.5}, "map:1"),
        cells(PlaceColumn.EVIDENCE_N, {(-9, 40): -3.0}, "map:1"),
    )
    again = Graph()
    again.load(graph.snapshot())

    assert again.digest() == graph.digest()
    assert again.places.value(ROOT_MAP, 2, 3, PlaceColumn.OBSTACLE) == 0.0
    assert again.places.value("map:1", 2, 3, PlaceColumn.OBSTACLE) == 0.5
    assert again.places.value("map:1", -9, 40, PlaceColumn.EVIDENCE_N) == -3.0
    assert again.places.value(ROOT_MAP, -9, 40, PlaceColumn.EVIDENCE_N) is None


def test_the_activation_of_a_sub_maps_place_nodes_decays_as_the_roots_does() -> None:
    fine = Map(id="map:1", cell_m=0.5, parent=ROOT_MAP)
    graph = graph_of(
        Decay(place_activation=0.1),
        fine,
        cells(PlaceColumn.ACTIVATION, {(2, 3): 1.0}),
        cells(PlaceColumn.ACTIVATION, {(2, 3): 1.0}, "map:1"),
    )
    graph.cycle = 4
    here = graph.place(2, 3)
    there = graph.place(2, 3, "map:1")

    assert here is not None
    assert there is not None
    assert here.activation == there.activation == pytest.approx(0.6)


def test_each_of_the_eight_links_of_a_place_node_is_kept_once() -> None:
    graph = graph_of(
        cells(PlaceColumn.WEIGHT_E, {(5, 5): 0.1}),
        cells(PlaceColumn.WEIGHT_NE, {(5, 5): 0.2}),
        cells(PlaceColumn.WEIGHT_N, {(5, 5): 0.3}),
        cells(PlaceColumn.WEIGHT_NW, {(5, 5): 0.4}),
    )
    weights = _weights(graph, 5, 5)

    assert len(weights) == 8
    assert weights["place:map:0:6:5"] == pytest.approx(0.1)
    assert weights["place:map:0:6:6"] == pytest.approx(0.2)
    assert weights["place:map:0:5:6"] == pytest.approx(0.3)
    assert weights["place:map:0:4:6"] == pytest.approx(0.4)
    assert weights["place:map:0:4:5"] == 1.0

    back = _weights(graph, 6, 6)
    assert back["place:map:0:5:5"] == pytest.approx(0.2)


def test_links_lead_to_place_nodes_that_exist_alone() -> None:
    graph = graph_of(cells(PlaceColumn.ROAD, {(0, 0): 1.0}))
    targets = set(_weights(graph, 0, 0))

    assert targets == {"place:map:0:1:0", "place:map:0:1:1", "place:map:0:0:1"}


def test_written_cells_are_those_whose_value_is_not_zero() -> None:
    graph = graph_of(cells(PlaceColumn.ROAD, {(40, -3): 0.5, (1, 1): 1.0, (2, 2): 0.0}))
    found, values = graph.places.written_cells(ROOT_MAP, PlaceColumn.ROAD)
    where = [tuple(cell) for cell in found.tolist()]
    found = dict(zip(where, values.tolist(), strict=True))

    assert found == {(40, -3): 0.5, (1, 1): 1.0}


def test_a_snapshot_has_the_columns_that_were_written() -> None:
    graph = graph_of(cells(PlaceColumn.ROAD, {(0, 0): 1.0}))
    snapshot = graph.snapshot()
    (tile,) = snapshot.tiles
    assert list(tile.columns) == [PlaceColumn.ROAD]

    again = Graph()
    again.load(snapshot)
    assert again.digest() == graph.digest()


def test_a_tile_of_another_side_is_rejected() -> None:
    column = Array.of(np.zeros((TILE_SIDE, TILE_SIDE + 1), np.float32))
    tile = PlaceTile(x=0, y=0, columns={PlaceColumn.ROAD: column})

    with pytest.raises(MessageError, match="road of shape"):
        graph_of(tile)
