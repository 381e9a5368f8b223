"""Travelling salesman problems and tours in TSPLIB's files, right and wrong."""

from __future__ import annotations

import bz2
import gzip
import logging
import lzma
from pathlib import Path

import numpy as np
import pytest

from cogmap.data import tsplib
from cogmap.errors import UsageError

SQUARE = """NAME : square
COMMENT: four corners
TYPE : TSP
DIMENSION : 4
EDGE_WEIGHT_TYPE : EUC_2D
NODE_COORD_SECTION
1 0 0
2 0.0 10.4
3 1.05e1 10.4
4 10.5 0
EOF
"""
TOUR = """NAME : square.opt.tour
TYPE : TOUR
DIMENSION : 4
TOUR_SECTION
1
4
3
2
-1
EOF
"""


def _file(folder: Path, text: str, name: str = "square.tsp") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def _length(weight_type: str, first: tuple[float, float], second: tuple[float, float]) -> float:
    positions = np.array([first, second])
    return float(tsplib.lengths(positions, weight_type)[0, 1])


def test_a_problem_is_read_with_its_lengths_rounded_to_the_nearest(tmp_path: Path) -> None:
    problem = tsplib.read(_file(tmp_path, SQUARE))

    assert problem.name == "square"
    assert problem.positions.tolist() == [[0, 0], [0, 10.4], [10.5, 10.4], [10.5, 0]]
    assert problem.lengths[0].tolist() == [0, 10, 15, 11]
    assert np.array_equal(problem.lengths, problem.lengths.T)


@pytest.mark.parametrize(
    ("suffix", "packed"), [(".xz", lzma.compress), (".gz", gzip.compress), (".bz2", bz2.compress)]
)
def test_a_packed_problem_and_its_tour_are_found(tmp_path: Path, suffix: str, packed) -> None:
    (tmp_path / f"square.tsp{suffix}").write_bytes(packed(SQUARE.encode()))
    (tmp_path / f"square.opt.tour{suffix}").write_bytes(packed(TOUR.encode()))
    (problem,) = tsplib.folder(tmp_path).problems

    assert len(problem) == 4
    assert tsplib.optimal_tour(tmp_path, problem) is not None


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("NODE_COORD_SECTION", "NODE_COORD_SECTION:"),
        ("NODE_COORD_SECTION", "node_coord_section"),
        (" : ", ":"),
        (" : ", " "),
        ("four corners", "a: b, best length: 12"),
        ("four corners", "coins carr\xe9s"),
        ("EUC_2D\n", "EUC_2D (rounded)\nDISPLAY_DATA_TYPE : COORD_DISPLAY\n"),
        ("\n", "\r\n"),
        ("NAME", "\xef\xbb\xbfNAME"),
        ("EOF", "-1\nEOF"),
        ("EOF\n", ""),
    ],
)
def test_headers_are_read_as_others_write_them(tmp_path: Path, old: str, new: str) -> None:
    plain = tsplib.read(_file(tmp_path, SQUARE))
    path = tmp_path / "other.tsp"
    path.write_bytes(SQUARE.replace(old, new).encode("latin-1"))

    assert np.array_equal(tsplib.read(path).positions, plain.positions)


def test_pseudo_euclidean_lengths_are_rounded_up() -> None:
    assert _length("ATT", (0, 0), (10, 0)) == 4.0
    assert _length("ATT", (0, 0), (30, 10)) == 10.0


def test_geographical_lengths_are_kilometres_along_the_earth() -> None:
    quarter_km = 6378.388 * 3.141592 / 2

    assert _length("GEO", (0, 0), (90, 0)) == np.floor(quarter_km + 1.0)
    assert _length("GEO", (10.30, 0), (10.30, 0.30)) == 55.0


def test_a_node_is_no_distance_from_itself() -> None:
    positions = np.array([[38.24, 20.42], [39.57, 26.15]])

    for weight_type in tsplib.WEIGHT_TYPES:
        assert np.diag(tsplib.lengths(positions, weight_type)).tolist() == [0, 0]


def test_a_tour_is_read_counted_from_nought(tmp_path: Path) -> None:
    path = _file(tmp_path, TOUR, "square.opt.tour")

    assert tsplib.read_tour(path).tolist() == [0, 3, 2, 1]


def test_the_optimal_tour_of_a_problem_lies_beside_it(tmp_path: Path) -> None:
    problem = tsplib.read(_file(tmp_path, SQUARE))
    assert tsplib.optimal_tour(tmp_path, problem) is None

    _file(tmp_path, TOUR, "square.opt.tour")
    tour = tsplib.optimal_tour(tmp_path, problem)
    assert tour is not None
    assert tour.tolist() == [0, 3, 2, 1]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("1\n4\n3\n2\n-1\n", "1 4 3 2 -1\n"),
        ("-1\n", ""),
        ("DIMENSION : 4\n", ""),
        ("TOUR_SECTION", "TOUR_SECTION :"),
    ],
)
def test_tours_are_read_as_others_write_them(tmp_path: Path, old: str, new: str) -> None:
    path = _file(tmp_path, TOUR.replace(old, new), "square.opt.tour")

    assert tsplib.read_tour(path).tolist() == [0, 3, 2, 1]


def test_an_optimal_tour_of_another_problem_is_refused(tmp_path: Path) -> None:
    problem = tsplib.read(_file(tmp_path, SQUARE))
    shorter = TOUR.replace("DIMENSION : 4", "DIMENSION : 3").replace("\n4\n", "\n")
    _file(tmp_path, shorter, "square.opt.tour")

    with pytest.raises(UsageError, match="3 nodes, square 4"):
        tsplib.optimal_tour(tmp_path, problem)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("EUC_2D", "EXPLICIT", "line 5: expected one of EUC_2D, ATT, GEO"),
        ("DIMENSION : 4", "DIMENSION : four", "line 4: expected a number of nodes"),
        ("DIMENSION : 4", "DIMENSION : 5", "line 4: expected 4, the number of nodes"),
        ("2 0.0 10.4", "2 0.0 nan", "line 8: expected 2 and two coordinates"),
        ("2 0.0 10.4", "2 0.0", "line 8: expected 2 and two coordinates"),
        ("2 0.0 10.4", "7 0.0 10.4", "line 8: expected 2 and two coordinates"),
        ("TYPE : TSP", "A = TSP", "line 3: expected KEY : VALUE"),
        ("DIMENSION : 4\n", "", "has no line DIMENSION"),
        ("NODE_COORD_SECTION", "SECTION : 1", "line 7: expected KEY : VALUE"),
    ],
)
def test_a_wrong_problem_is_named_by_what_was_expected(
    tmp_path: Path, old: str, new: str, expected: str
) -> None:
    path = _file(tmp_path, SQUARE.replace(old, new))

    with pytest.raises(UsageError, match=f"{path}.*{expected}"):
        tsplib.read(path)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("\n3\n", "\n5\n", "line 7: expected a node from 1 to 4"),
        ("\n3\n", "\n4\n", "line 7: expected a node from 1 to 4"),
        ("\n3\n", "\nx\n", "line 7: expected a node from 1 to 4"),
        ("\n3\n", "\n", "visits 3 of 4"),
    ],
)
def test_a_wrong_tour_is_named_by_what_was_expected(
    tmp_path: Path, old: str, new: str, expected: str
) -> None:
    path = _file(tmp_path, TOUR.replace(old, new), "square.opt.tour")

    with pytest.raises(UsageError, match=expected):
        tsplib.read_tour(path)


@pytest.mark.parametrize(("before", "after"), [("FIXED_EDGES_SECTION\n1 2\n-1\n", ""), ("", "1")])
def test_a_problem_with_another_section_is_left_out_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, before: str, after: str
) -> None:
    _file(tmp_path, SQUARE, "a.tsp")
    fixed = "FIXED_EDGES_SECTION\n1 2\n-1\n"
    other = SQUARE.replace("NODE_COORD", f"{before}NODE_COORD")
    _file(tmp_path, other.replace("EOF", f"{fixed}EOF") if after else other, "b.tsp")
    with caplog.at_level(logging.WARNING, "cogmap"):
        found = tsplib.folder(tmp_path)

    assert [problem.name for problem in found.problems] == ["a"]
    assert "left out: " in caplog.text
    assert "got 'FIXED_EDGES_SECTION': such problems are not read" in caplog.text


def test_a_folder_is_read_by_name_and_what_is_left_out_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"has no \.tsp"):
        tsplib.folder(tmp_path)
    with pytest.raises(UsageError, match="there is no folder"):
        tsplib.folder(tmp_path / "none")

    _file(tmp_path, "EDGE_WEIGHT_TYPE : EXPLICIT\nEDGE_WEIGHT_SECTION\n0 1\n", "c.tsp")
    with pytest.raises(UsageError, match="of the types EUC_2D, ATT, GEO"):
        tsplib.folder(tmp_path)

    for name in ("b", "a"):
        _file(tmp_path, SQUARE, f"{name}.tsp")
    found = tsplib.folder(tmp_path)

    assert [problem.name for problem in found.problems] == ["a", "b"]
    assert len(found.left_out) == 1
    assert "c.tsp, line 1: expected one of EUC_2D" in found.left_out[0]
