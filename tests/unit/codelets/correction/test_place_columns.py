"""What is known of place nodes moves with the path as it is corrected."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from benchmarks.explore.boundaries import boundary_score
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import rotate
from cogmap.graph.crossings import crossings
from cogmap.graph.graph import Graph
from cogmap.graph.window import EVIDENCE_COLUMNS, WEIGHT_COLUMNS
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.graph import Cells
from cogmap.schemas.nodes import CORRECTION_ID, ROOT_MAP, Correction, Map, PlaceColumn
from cogmap.services.codelets.cells import MAX_CELLS
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.correction.place_columns import move_places
from cogmap.services.codelets.mapping.evidence import weights_of
from cogmap.testing import graph_of, task
from tests.support.world.scenes import run

CUT = -3.0
FREE = 2.0
LENGTH = 60
# Where the path leads straight along x, with a wall on its left.
WALL_M = np.array([[0.0, 10.4, LENGTH, 10.4]])

Values = dict[tuple[int, int], float]


def _cells(column: PlaceColumn, cells: npt.ArrayLike, values: npt.ArrayLike) -> Cells:
    return Cells(
        column=column,
        cells=Array.of(np.asarray(cells).reshape(-1, 2), "<i4"),
        values=Array.of(np.asarray(values).reshape(-1), "<f4"),
    )


def _one(column: PlaceColumn, i: int, j: int, value: float) -> Cells:
    return _cells(column, [(i, j)], [value])


def _path(heading_rad: float = 0.0, shift_m: tuple[float, float] = (0.0, 0.0)) -> Floats:
    """Poses along x from the origin, all turned about it and shifted."""
    along_m = np.column_stack([np.arange(LENGTH + 1.0), np.zeros(LENGTH + 1)])
    positions_m = rotate(along_m, heading_rad) + shift_m
    headings_rad = np.full(LENGTH + 1, heading_rad)
    return np.column_stack([positions_m, headings_rad])


def _values(graph: Graph, column: PlaceColumn) -> Values:
    """The values of a column that are not 0, by cell."""
    cells, values = graph.places.written_cells(ROOT_MAP, column)
    return {(i, j): value for (i, j), value in zip(cells.tolist(), values.tolist(), strict=True)}


def _with_wall() -> Graph:
    """A map in which the links that the wall crosses are cut, and others on its right free."""
    found = crossings(WALL_M[:, :2], WALL_M[:, 2:])
    graph = graph_of()
    across, along = np.meshgrid(np.arange(LENGTH), np.arange(9), indexing="ij")
    inside = np.column_stack([across.ravel(), along.ravel()])

    for direction, (evidence, weight) in enumerate(
        zip(EVIDENCE_COLUMNS, WEIGHT_COLUMNS, strict=True)
    ):
        is_here = found.direction == direction
        cut = np.column_stack([found.i, found.j])[is_here]
        graph.change(
            [
                _cells(evidence, inside, np.full(len(inside), FREE)),
                _cells(evidence, cut, np.full(len(cut), CUT)),
                _cells(weight, cut, np.zeros(len(cut))),
            ]
        )
    return graph


def test_a_shift_of_whole_cells_moves_every_column_by_them() -> None:
    graph = graph_of(
        _one(PlaceColumn.ROAD, 5, 3, 0.75),
        _one(PlaceColumn.OBSTACLE, 6, 4, 0.5),
        _one(PlaceColumn.EVIDENCE_NW, 7, 5, CUT),
        _one(PlaceColumn.WEIGHT_NW, 7, 5, 0.0),
        _one(PlaceColumn.EVIDENCE_E, 8, 6, FREE),
    )
    graph.change(move_places(graph, _path(), _path(shift_m=(2.0, -3.0))))

    assert _values(graph, PlaceColumn.ROAD) == {(7, 0): 0.75}
    assert _values(graph, PlaceColumn.OBSTACLE) == {(8, 1): 0.5}
    assert _values(graph, PlaceColumn.EVIDENCE_NW) == {(9, 2): CUT}
    assert _values(graph, PlaceColumn.EVIDENCE_E) == {(10, 3): FREE}

    moved_to = graph.places.value(ROOT_MAP, 9, 2, PlaceColumn.WEIGHT_NW)
    left_behind = graph.places.value(ROOT_MAP, 7, 5, PlaceColumn.WEIGHT_NW)
    assert (moved_to, left_behind) == (0.0, 1.0)


def test_a_path_that_does_not_move_writes_nothing() -> None:
    assert move_places(_with_wall(), _path(), _path()) == []


def test_a_quarter_turn_turns_the_directions_of_links() -> None:
    graph = graph_of(
        _one(PlaceColumn.EVIDENCE_E, 3, 0, CUT),
        _one(PlaceColumn.EVIDENCE_NE, 4, 0, FREE),
    )
    graph.change(move_places(graph, _path(), _path(np.pi / 2)))

    assert _values(graph, PlaceColumn.EVIDENCE_N) == {(0, 3): CUT}
    assert _values(graph, PlaceColumn.EVIDENCE_NW) == {(0, 4): FREE}
    assert not _values(graph, PlaceColumn.EVIDENCE_E)
    assert not _values(graph, PlaceColumn.EVIDENCE_NE)


@pytest.mark.parametrize("heading_rad", [0.05, -0.2, 0.35])
def test_a_wall_stands_where_the_corrected_path_has_it(heading_rad: float) -> None:
    graph = _with_wall()
    graph.change(move_places(graph, _path(), _path(heading_rad, (1.3, 0.6))))

    ends_m = rotate(WALL_M.reshape(2, 2), heading_rad) + np.array([1.3, 0.6])
    window = graph.places.window(ROOT_MAP, [*WEIGHT_COLUMNS, *EVIDENCE_COLUMNS])
    score = boundary_score(window, 1.0, ends_m.reshape(1, 4))
    assert score.crossed > 2 * LENGTH
    assert score.precision > 0.97
    assert score.recall > 0.97


def test_weights_follow_from_the_evidence_that_has_moved() -> None:
    graph = _with_wall()
    graph.change(move_places(graph, _path(), _path(0.1)))
    window = graph.places.window(ROOT_MAP, [*WEIGHT_COLUMNS, *EVIDENCE_COLUMNS])

    assert (window.evidence() < 0).any()
    assert np.array_equal(window.weights(), weights_of(window.evidence()))


def test_of_a_cut_and_a_free_link_that_move_to_one_the_cut_stays() -> None:
    graph = graph_of(
        _one(PlaceColumn.EVIDENCE_N, 2, 5, CUT),
        _one(PlaceColumn.EVIDENCE_N, 40, 5, FREE),
    )
    together = _path()
    together[30:, 0] -= 38.0
    graph.change(move_places(graph, _path(), together))

    assert _values(graph, PlaceColumn.EVIDENCE_N)[2, 5] == CUT


def test_many_cells_are_written_in_parts() -> None:
    side = 300
    cells = np.argwhere(np.ones((side, side), bool))
    graph = graph_of(
        _cells(PlaceColumn.OBSTACLE, cells[: len(cells) // 2], np.full(len(cells) // 2, 0.5)),
        _cells(PlaceColumn.OBSTACLE, cells[len(cells) // 2 :], np.full(len(cells) // 2, 0.5)),
    )
    operations = move_places(graph, _path(), _path(shift_m=(side + 0.0, 0.0)))

    sizes = []
    for operation in operations:
        assert isinstance(operation, Cells)
        sizes.append(len(operation.cells.numpy()))
    assert len(sizes) > 1
    assert max(sizes) <= MAX_CELLS
    assert sum(sizes) == 2 * side**2


def _correction(old: Floats, new: Floats) -> Correction:
    """That the path is corrected from one to the other."""
    stamps_s = np.arange(len(old), dtype=float)
    rows = np.column_stack([stamps_s, old, new])
    return Correction(id=CORRECTION_ID, rows=Matrix.of(rows))


def test_a_sub_map_moves_by_its_frame_and_keeps_its_place_nodes() -> None:
    hall = Map(id="map:hall", cell_m=0.5, parent=ROOT_MAP, x_m=10.0, y_m=2.0, heading_rad=0.3)
    room = Map(id="map:room", cell_m=0.1, parent="map:hall", x_m=1.0)
    graph = graph_of(
        hall,
        room,
        _one(PlaceColumn.ROAD, 3, 4, 0.75),
        Cells(
            map="map:hall",
            column=PlaceColumn.ROAD,
            cells=Array.of([(3, 4)], "<i4"),
            values=Array.of([0.5], "<f4"),
        ),
        _correction(_path(), _path(shift_m=(2.0, -3.0))),
    )
    graph.change(run(task("apply_correction"), graph, Config()).operations)

    moved = graph.get(Map, "map:hall")
    assert moved is not None
    assert (moved.x_m, moved.y_m) == pytest.approx((12.0, -1.0))
    assert moved.heading_rad == pytest.approx(0.3)
    assert graph.get(Map, "map:room") == room
    assert graph.places.value("map:hall", 3, 4, PlaceColumn.ROAD) == 0.5
    assert _values(graph, PlaceColumn.ROAD) == {(5, 1): 0.75}
