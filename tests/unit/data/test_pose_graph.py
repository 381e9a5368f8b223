"""Pose graphs in g2o and TORO files, right and wrong."""

from __future__ import annotations

import bz2
import gzip
import logging
import lzma
from pathlib import Path

import numpy as np
import pytest

from cogmap.data import pose_graph
from cogmap.data.pose_graph import PoseGraphFile, read_true_positions
from cogmap.errors import UsageError
from cogmap.estimation.pose_graph import Constraints, cost
from cogmap.geometry.se2 import relative

G2O = """VERTEX_SE2 0 0 0 0
VERTEX_SE2 1 1.5 -2 0.25

# a remark
EDGE_SE2 0 1 1 2 0.5 11 12 13 22 23 33
"""
TORO = """VERTEX2 0 0 0 0
VERTEX2 7 1.1 2.1 0.5
EDGE2 0 7 1 2 0.5 11 12 22 33 13 23
"""
SYMMETRIC = [[11, 12, 13], [12, 22, 23], [13, 23, 33]]
# Poses along an L, each measured from the one before it.
STEPS = [(0, 1, 1.02, -0.03, 0.04), (1, 2, 1.0, 0.02, 1.58), (2, 3, 0.98, 0.01, 0.02)]
POSES = [(0, 0, 0), (1, 0, 0), (2, 0, 1.5708), (2, 1, 1.5708)]
# gtsam's keys: a letter and an index in 64 bits; Python's floats have 53 for whole numbers.
KEY = (ord("x") << 56) + 1


def _file(folder: Path, text: str, name: str = "a.g2o") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def _l_shape(first_id: int = 0) -> str:
    lines = []
    for number, pose in enumerate(POSES):
        lines.append(f"VERTEX_SE2 {first_id + number} {pose[0]} {pose[1]} {pose[2]}")
    for i, j, *measured in STEPS:
        values = " ".join(map(str, measured))
        lines.append(f"EDGE_SE2 {first_id + i} {first_id + j} {values} 100 0 0 100 0 400")
    return "\n".join(lines) + "\n"


def _same(one: PoseGraphFile, other: PoseGraphFile) -> bool:
    pairs = zip(vars(one).items(), vars(other).values(), strict=True)
    return all(name == "ids" or np.array_equal(a, b) for (name, a), b in pairs)


def _cost(graph: PoseGraphFile) -> float:
    constraints = Constraints(graph.i, graph.j, graph.measurement, graph.information)
    return cost(graph.poses, constraints)


def test_a_g2o_file_is_read_with_the_upper_triangle_row_by_row(tmp_path: Path) -> None:
    graph = pose_graph.read(_file(tmp_path, G2O))

    assert graph.poses.tolist() == [[0, 0, 0], [1.5, -2, 0.25]]
    assert graph.i.tolist() == [0]
    assert graph.j.tolist() == [1]
    assert graph.measurement.tolist() == [[1, 2, 0.5]]
    assert graph.information[0].tolist() == SYMMETRIC


def test_a_toro_file_is_read_in_its_own_order_of_information(tmp_path: Path) -> None:
    graph = pose_graph.read(_file(tmp_path, TORO, "a.graph"))

    assert graph.ids == (0, 7)
    assert graph.information[0].tolist() == SYMMETRIC


@pytest.mark.parametrize("packed", [lzma.compress, gzip.compress, bz2.compress])
def test_a_packed_file_is_known_by_its_content(tmp_path: Path, packed) -> None:
    path = tmp_path / "a.g2o"
    path.write_bytes(packed(G2O.encode()))

    assert len(pose_graph.read(path).poses) == 2


def test_keys_of_64_bits_are_told_apart(tmp_path: Path) -> None:
    plain = pose_graph.read(_file(tmp_path, _l_shape()))
    graph = pose_graph.read(_file(tmp_path, _l_shape(KEY)))

    assert graph.ids == tuple(range(KEY, KEY + 4))
    assert _same(graph, plain)

    absent = _l_shape(KEY) + f"EDGE_SE2 {KEY} {KEY + 4} 1 0 0 100 0 0 100 0 400\n"
    with pytest.raises(UsageError, match=f"line 8: expected an edge between .*, not {KEY + 4}"):
        pose_graph.read(_file(tmp_path, absent))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("", ""),
        ("VERTEX_SE2 1", "FIX 0\nVERTEX_SE2 1"),
        ("VERTEX_SE2 1", "PARAMS_SE2OFFSET 0 0 0 0\nVERTEX_SE2 1"),
        ("\n", "\r\n"),
        ("VERTEX_SE2 0", "\ufeffVERTEX_SE2 0"),
        ("100 0 400\n", "1e2 0 4E2 # odometry\n"),
    ],
    ids=["plain", "fixed", "parameters", "line ends", "byte-order mark", "remarks"],
)
def test_what_others_write_around_a_graph_leaves_it_as_it_is(
    tmp_path: Path, old: str, new: str
) -> None:
    plain = pose_graph.read(_file(tmp_path, _l_shape()))
    text = _l_shape().replace(old, new) if old != "VERTEX_SE2 0" else "\ufeff" + _l_shape()

    assert _same(pose_graph.read(_file(tmp_path, text)), plain)


def test_equivalences_of_toro_are_left_out_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    plain = pose_graph.read(_file(tmp_path, TORO, "a.graph"))
    with caplog.at_level(logging.WARNING, "cogmap"):
        graph = pose_graph.read(_file(tmp_path, TORO + "EQUIV 0 7\n", "b.graph"))

    assert _same(graph, plain)
    assert "b.graph: lines of EQUIV are not read" in caplog.text


def test_edges_that_run_backwards_are_as_those_forwards(tmp_path: Path) -> None:
    forwards = pose_graph.read(_file(tmp_path, _l_shape()))
    measured = np.array([step[2:] for step in STEPS])
    from_behind = relative(measured, np.zeros(3))
    backwards = _l_shape()
    for (i, j, *values), behind in zip(STEPS, from_behind.tolist(), strict=True):
        old = " ".join(map(str, (i, j, *values)))
        new = " ".join(map(str, (j, i, *behind)))
        backwards = backwards.replace(f"EDGE_SE2 {old}", f"EDGE_SE2 {new}")
    graph = pose_graph.read(_file(tmp_path, backwards))
    as_written = Constraints(
        forwards.j, forwards.i, from_behind, np.tile(np.diag([100.0, 100.0, 400.0]), (3, 1, 1))
    )

    assert graph.i.tolist() == forwards.i.tolist()
    assert np.allclose(graph.measurement, forwards.measurement)
    assert _cost(graph) == pytest.approx(cost(graph.poses, as_written), rel=0.1)


def test_a_toro_file_may_name_the_observed_pose_first(tmp_path: Path) -> None:
    lines = [f"VERTEX2 {n} {x} {y} {heading}" for n, (x, y, heading) in enumerate(POSES)]
    steps = [(i, j, *values, "100 0 100 400 0 0") for i, j, *values in STEPS]
    observer_first = [" ".join(map(str, ("EDGE2", i, j, *rest))) for i, j, *rest in steps]
    observed_first = [" ".join(map(str, ("EDGE2", j, i, *rest))) for i, j, *rest in steps]
    plain = pose_graph.read(_file(tmp_path, "\n".join(lines + observer_first), "a.graph"))
    graph = pose_graph.read(_file(tmp_path, "\n".join(lines + observed_first), "b.graph"))

    assert _same(graph, plain)


def test_edges_alone_start_from_odometry(tmp_path: Path) -> None:
    edges = [line for line in _l_shape().splitlines() if line.startswith("EDGE")]
    graph = pose_graph.read(_file(tmp_path, "\n".join(edges)))

    assert graph.ids == (0, 1, 2, 3)
    assert graph.poses[0].tolist() == [0, 0, 0]
    assert graph.poses[1].tolist() == pytest.approx([1.02, -0.03, 0.04])
    assert _cost(graph) == pytest.approx(0.0, abs=1e-18)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("EDGE_SE2 0 1 1 2 0.5 11 12 13 22 23", "11 numbers"),
        ("EDGE_SE2 0 1 1 2 x 11 12 13 22 23 33", "11 numbers"),
        ("EDGE_SE2 0 1 1 2 nan 11 12 13 22 23 33", "11 numbers"),
        ("EDGE_SE2 0 1 1,02 2 0,5 11 12 13 22 23 33", "numbers with decimal points"),
        ("EDGE_SE2 0.5 1 1 2 3 11 12 13 22 23 33", "two ids"),
        ("EDGE_SE2 0 5 1 2 3 11 12 13 22 23 33", "between poses of the file, not 5.*: add it"),
        ("EDGE_SE2 1 1 1 2 3 11 12 13 22 23 33", "between two poses.*: remove it"),
        ("EDGE_SE2 0 1 1 2 0.5 100 0 0 0 0 0", "positive definite information.*: give x, y and"),
        ("EDGE_SE2 0 1 1 2 0.5 0 0 0 0 0 0", "positive definite information.*: give x, y and"),
        ("EDGE_SE2 0 1 1 2 0.5 1 2 0 1 0 1", "positive definite information.*: give x, y and"),
        ("VERTEX_SE2 2 0 0", "an id, x, y and heading"),
        ("VERTEX_SE2 1 0 0 0", "id has not been there before.*: remove one of them"),
        ("VERTEX_SE3:QUAT 2 0 0 0 0 0 0 1", "VERTEX_SE2 or EDGE_SE2.*: .*lines of VERTEX_SE3"),
        ("VERTEX_XY 2 0 0", "VERTEX_SE2 or EDGE_SE2.*: .*remove lines of VERTEX_XY"),
        ("EDGE_PRIOR_SE2 0 0 0 0 9 0 0 9 0 9", "VERTEX_SE2 or .*: .*lines of EDGE_PRIOR_SE2"),
        ("FIX 0 1", "one fixed pose in all, not 1 too.*: put an edge in its place"),
        ("FIX", "the id of a pose"),
    ],
)
def test_a_wrong_line_is_named_with_file_number_and_what_was_expected(
    tmp_path: Path, line: str, expected: str
) -> None:
    path = _file(tmp_path, G2O + line + "\n")

    with pytest.raises(UsageError, match=f"{path}, line 6: expected .*{expected}"):
        pose_graph.read(path)


def test_a_file_that_cannot_be_read_is_named_with_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "b.g2o").mkdir()

    with pytest.raises(UsageError, match=r"there is no file .*none.*: give a pose graph"):
        pose_graph.read(tmp_path / "none.g2o")
    with pytest.raises(UsageError, match=r"cannot be read .*: give a pose graph"):
        pose_graph.read(tmp_path / "b.g2o")
    with pytest.raises(UsageError, match=r"none of \.g2o, \.graph, \.toro"):
        pose_graph.read(tmp_path / "a.csv")


def test_a_graph_without_edges_is_none(tmp_path: Path) -> None:
    poses_alone = G2O.splitlines()[:2]
    path = _file(tmp_path, "\n".join(poses_alone))

    with pytest.raises(UsageError, match="2 poses and 0 edges"):
        pose_graph.read(path)


def test_a_pose_that_no_edge_leads_to_is_named(tmp_path: Path) -> None:
    path = _file(tmp_path, "VERTEX_SE2 99 50 50 0\n" + G2O)

    with pytest.raises(UsageError, match="no edge leads from pose 99 to the next, pose 0: add"):
        pose_graph.read(path)


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
