"""Tours that people drew, right and wrong."""

from __future__ import annotations

import lzma
from pathlib import Path

import pytest

from cogmap.data.human_tours import read_folder
from cogmap.errors import UsageError

GRAPH = """DIMENSION : 3
EDGE_WEIGHT_TYPE : EUC_2D
NODE_COORD_SECTION
1 0 0
2 3 0
3 3 4
EOF
"""
HEADER = "graph,participant,x,y,cost\n"
TOUR = '0,7,"3,0,3","4,0,0",12\n'


def _folder(folder: Path, tours: str) -> Path:
    for number in (0, 1):
        (folder / f"Graph{number}.lib").write_text(GRAPH)
    (folder / "tours.csv").write_text(tours)
    return folder


def test_tours_are_orders_of_the_nodes_of_their_problem(tmp_path: Path) -> None:
    (drawn,) = read_folder(_folder(tmp_path, HEADER + TOUR))

    assert drawn.problem.name == "Graph0"
    assert [tour.tolist() for tour in drawn.tours] == [[2, 0, 1]]


def test_a_tour_passes_two_nodes_at_one_place_one_after_the_other(tmp_path: Path) -> None:
    tour = TOUR.replace("3,0,3", "3,0,0,3").replace("4,0,0", "4,0,0,0")
    folder = _folder(tmp_path, HEADER + tour)
    for path in folder.glob("Graph*.lib"):
        path.write_text(
            GRAPH.replace("DIMENSION : 3", "DIMENSION : 4").replace("EOF", "4 0 0\nEOF")
        )

    (drawn,) = read_folder(folder)
    assert [tour.tolist() for tour in drawn.tours] == [[2, 0, 3, 1]]


def test_packed_tours_are_read_as_they_are(tmp_path: Path) -> None:
    folder = _folder(tmp_path, "")
    (folder / "tours.csv").unlink()
    (folder / "tours.csv.xz").write_bytes(lzma.compress((HEADER + TOUR + TOUR).encode()))

    (drawn,) = read_folder(folder)
    assert len(drawn.tours) == 2


@pytest.mark.parametrize(
    ("tours", "expected"),
    [
        ("graph,x\n", "line 1: expected the columns graph, participant, x, y"),
        (HEADER + TOUR.replace("0,7", "5,7"), "line 2: expected a graph of the folder: 0, 1"),
        (HEADER + TOUR.replace("3,0,3", "3,3,3"), "line 2: expected a tour past every node"),
        (HEADER + TOUR.replace("3,0,3", "3,0"), "line 2: expected a tour past every node"),
        (HEADER + TOUR.replace("3,0,3", "3,0,x"), "line 2: expected a tour past every node"),
        (HEADER + TOUR + "\n", "line 3: expected a graph"),
    ],
)
def test_a_wrong_row_is_named_by_what_was_expected(
    tmp_path: Path, tours: str, expected: str
) -> None:
    folder = _folder(tmp_path, tours)

    with pytest.raises(UsageError, match=expected):
        read_folder(folder)


def test_a_folder_without_problems_or_tours_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"has no Graph"):
        read_folder(tmp_path)

    (tmp_path / "Graph0.lib").write_text(GRAPH)
    with pytest.raises(UsageError, match=r"has no tours\.csv"):
        read_folder(tmp_path)
