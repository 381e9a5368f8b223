"""Pose graphs in g2o and TORO files, right and wrong."""

from __future__ import annotations

import lzma
from pathlib import Path

import numpy as np
import pytest

from cogmap.data.g2o import read_g2o
from cogmap.data.pose_graph import read_true_positions
from cogmap.data.toro import read_toro
from cogmap.errors import UsageError

G2O = """VERTEX_SE2 0 0 0 0
VERTEX_SE2 1 1.5 -2 0.25

# a remark
EDGE_SE2 0 1 1 2 0.5 11 12 13 22 23 33
"""
TORO = """VERTEX2 0 0 0 0
VERTEX2 7 1.5 -2 0.25
EDGE2 7 0 1 2 0.5 11 12 22 33 13 23
"""
SYMMETRIC = [[11, 12, 13], [12, 22, 23], [13, 23, 33]]


def _file(folder: Path, text: str, name: str = "a.g2o") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_a_g2o_file_is_read_with_the_upper_triangle_row_by_row(tmp_path: Path) -> None:
    graph = read_g2o(_file(tmp_path, G2O))

    assert graph.poses.tolist() == [[0, 0, 0], [1.5, -2, 0.25]]
    assert graph.i.tolist() == [0]
    assert graph.j.tolist() == [1]
    assert graph.measurement.tolist() == [[1, 2, 0.5]]
    assert graph.information[0].tolist() == SYMMETRIC


def test_a_toro_file_is_read_in_its_own_order_of_information(
    tmp_path: Path,
) -> None:
    graph = read_toro(_file(tmp_path, TORO))

    assert graph.ids.tolist() == [0, 7]
    assert graph.i.tolist() == [1]
    assert graph.j.tolist() == [0]
    assert graph.information[0].tolist() == SYMMETRIC


def test_a_packed_file_is_read_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "a.g2o.xz"
    path.write_bytes(lzma.compress(G2O.encode()))

    assert len(read_g2o(path).poses) == 2


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("EDGE_SE2 0 1 1 2 0.5 11 12 13 22 23", "11 numbers"),
        ("EDGE_SE2 0 1 1 2 x 11 12 13 22 23 33", "11 numbers"),
        ("EDGE_SE2 0 1 1 2 nan 11 12 13 22 23 33", "11 numbers"),
        ("EDGE_SE2 0.5 1 1 2 3 11 12 13 22 23 33", "two ids"),
        ("EDGE_SE2 0 5 1 2 3 11 12 13 22 23 33", "between poses of the file, not 5"),
        ("EDGE_SE2 1 1 1 2 3 11 12 13 22 23 33", "between two poses"),
        ("VERTEX_SE2 2 0 0", "an id, x, y and heading"),
        ("VERTEX_SE2 1 0 0 0", "id has not been there before"),
        ("VERTEX_SE3 2 0 0 0 0 0 0 1", "begins with VERTEX_SE2 or EDGE_SE2"),
    ],
)
def test_a_wrong_line_is_named_with_file_number_and_what_was_expected(
    tmp_path: Path, line: str, expected: str
) -> None:
    path = _file(tmp_path, G2O + line + "\n")

    with pytest.raises(UsageError, match=f"{path}, line 6: expected .*{expected}"):
        read_g2o(path)


@pytest.mark.parametrize("name", ["none.g2o", "."])
def test_a_file_that_cannot_be_read_is_said_so(tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError, match=r"there is no file|cannot read"):
        read_g2o(tmp_path / name)


def test_a_graph_without_edges_is_none(tmp_path: Path) -> None:
    poses_alone = G2O.splitlines()[:2]
    path = _file(tmp_path, "\n".join(poses_alone))

    with pytest.raises(UsageError, match="2 poses and 0 edges"):
        read_g2o(path)


@pytest.mark.parametrize(
    "text", ["1 2 0.5\n3 4 0.5\n", "0 1 2 0.5\n1 3 4 0.5\n\n"], ids=["without index", "with index"]
)
def test_true_poses_are_read_with_an_index_or_without(tmp_path: Path, text: str) -> None:
    positions = read_true_positions(_file(tmp_path, text))

    assert np.array_equal(positions, [[1, 2], [3, 4]])


def test_a_true_pose_without_a_heading_is_named_by_its_line(tmp_path: Path) -> None:
    path = _file(tmp_path, "1 2 0.5\n3 4\n")

    with pytest.raises(UsageError, match="line 2: expected x, y and heading"):
        read_true_positions(path)
