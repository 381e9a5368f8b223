"""The map correction benchmark on a square of four edges and two closures."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.benchmark import Setting
from benchmarks.map_correction import reference
from benchmarks.map_correction.false_groups import MIN_APART, false_closures
from benchmarks.map_correction.files import read_graph
from benchmarks.map_correction.measure import measure
from benchmarks.optional import trajectory_error_m
from cogmap.errors import UsageError
from cogmap.estimation.pose_graph import cost
from cogmap.estimation.reverse_replay import (
    close_loops,
    displacements,
    position_cost,
)
from cogmap.geometry.se2 import compose, integrate, relative
from tests.support.world.laps import laps

SQUARE = """VERTEX_SE2 0 0 0 0
VERTEX_SE2 1 1 0 1.5
VERTEX_SE2 2 1 1 3.1
VERTEX_SE2 3 0 1 -1.6
VERTEX_SE2 4 0.2 0.1 0
EDGE_SE2 0 1 1 0 1.5 100 0 0 100 0 100
EDGE_SE2 1 2 1 0 1.6 100 0 0 100 0 100
EDGE_SE2 2 3 1 0 1.6 100 0 0 100 0 100
EDGE_SE2 3 4 1 0 1.6 100 0 0 100 0 100
EDGE_SE2 0 4 0 0 0 100 0 0 100 0 100
EDGE_SE2 0 3 0 1 -1.57 100 0 0 100 0 100
"""


def _square(folder: Path, without: str = "") -> Path:
    path = folder / "square.g2o"
    kept = [line for line in SQUARE.splitlines() if line != without]
    path.write_text("\n".join(kept) + "\n")
    return path


def _setting(folder: Path) -> Setting:
    return Setting(folder, 1, print)


def test_a_graph_is_measured_against_exact_least_squares_and_gtsam(tmp_path: Path) -> None:
    pytest.importorskip("gtsam")
    pytest.importorskip("evo")
    truth = tmp_path / "truth.txt"
    truth.write_text("0 0 0\n1 0 1.57\n1 1 3.14\n0 1 -1.57\n0 0 0\n")
    metrics = measure(_setting(tmp_path), graph_path=_square(tmp_path), truth_path=truth)

    assert metrics["positions_cost_ratio"] <= 1.05
    assert metrics["ate_m"] < metrics["ate_uncorrected_m"]
    assert metrics["ate_vs_gtsam"] == pytest.approx(1.0, abs=0.02)
    assert metrics["incremental_closures"] == 1.0


def test_where_gtsam_gives_up_it_is_compared_with_by_its_slower_factors(
    tmp_path: Path,
) -> None:
    pytest.importorskip("gtsam")
    path = tmp_path / "certain.g2o"
    path.write_text(SQUARE.replace("100 0 0 100 0 100", "1e20 0 0 1e20 0 1e-3"))
    graph = read_graph(path)
    peer = reference.Gtsam(graph.poses, graph.constraints)
    assert peer.gives_up()
    assert not peer.gives_up()

    solved = peer.poses(peer.solve())
    assert cost(solved, graph.constraints) < cost(graph.poses, graph.constraints)


def test_the_best_positions_are_exact_where_a_loop_is_certain(tmp_path: Path) -> None:
    path = tmp_path / "certain.g2o"
    path.write_text(
        SQUARE.replace("EDGE_SE2 0 4 0 0 0 100 0 0 100", "EDGE_SE2 0 4 0 0 0 1e15 0 0 1e15")
    )
    graph = read_graph(path)
    known = displacements(graph.poses, graph.constraints)
    exact = position_cost(reference.best_positions(graph), graph.constraints, known)

    assert position_cost(
        close_loops(graph, 1e-9).positions_m, graph.constraints, known
    ) >= exact * (1 - 1e-9)


def test_without_gtsam_the_remedy_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gtsam", None)

    with pytest.raises(UsageError, match="run make bench-setup"):
        measure(_setting(tmp_path), graph_path=_square(tmp_path))


def test_a_file_of_another_kind_or_a_path_with_a_gap_is_refused(tmp_path: Path) -> None:
    table = tmp_path / "a.csv"
    gap = _square(tmp_path, without="EDGE_SE2 2 3 1 0 1.6 100 0 0 100 0 100")

    with pytest.raises(UsageError, match=r"none of \.g2o, \.graph, \.toro"):
        read_graph(table)
    with pytest.raises(UsageError, match="from pose 2 to the next"):
        read_graph(gap)


@pytest.mark.parametrize("loop", ["", "EDGE_SE2 0 2 2 0 0 100 0 0 100 0 100\n"])
def test_a_chain_and_an_exact_loop_have_a_cost_ratio_of_1(tmp_path: Path, loop: str) -> None:
    pytest.importorskip("gtsam")
    path = tmp_path / "chain.g2o"
    poses = "".join(f"VERTEX_SE2 {number} {number} 0 0\n" for number in range(3))
    steps = "".join(f"EDGE_SE2 {i} {i + 1} 1 0 0 100 0 0 100 0 100\n" for i in range(2))
    path.write_text(poses + steps + loop)
    metrics = measure(_setting(tmp_path), graph_path=path)

    assert metrics["positions_cost_ratio"] == pytest.approx(1.0)
    assert metrics["cost_vs_gtsam"] == pytest.approx(1.0)


def test_without_evo_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "evo.core.geometry", None)
    positions_m = np.zeros((3, 2))

    with pytest.raises(UsageError, match="run make bench-setup"):
        trajectory_error_m(positions_m, positions_m)


def test_a_truth_of_another_length_is_refused(tmp_path: Path) -> None:
    truth = tmp_path / "truth.txt"
    truth.write_text("0 0 0\n")

    with pytest.raises(UsageError, match="has 1 poses"):
        measure(_setting(tmp_path), graph_path=_square(tmp_path), truth_path=truth)


def test_the_false_closures_of_a_group_agree_with_one_another() -> None:
    graph = laps(4).graph
    false = false_closures(graph, 9, 3, np.random.default_rng(1))
    path = integrate(np.zeros(3), graph.steps.measurement)

    round_trip = relative(
        compose(relative(path[false.i[0]], path[false.i[1]]), false.measurement[1]),
        compose(false.measurement[0], relative(path[false.j[0]], path[false.j[1]])),
    )
    assert round_trip == pytest.approx(np.zeros(3), abs=1e-9)
    assert (np.abs(false.j - false.i) >= MIN_APART).all()


def test_a_path_too_short_for_false_closures_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="5 poses"):
        measure(_setting(tmp_path), graph_path=_square(tmp_path), has_false_groups=True)
