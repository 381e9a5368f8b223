"""The benchmark of several goals in order, on problems small enough for a test."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from benchmarks.commands import benchmarks
from benchmarks.planning import tours
from cogmap.errors import UsageError


def _problem(folder: Path, name: str, cities: int) -> Path:
    """Cities on a ring, whose shortest tour is round it."""
    angles_rad = np.linspace(0.0, 2 * np.pi, cities, endpoint=False)
    x = 1000 * np.cos(angles_rad)
    y = 1000 * np.sin(angles_rad)
    order = np.random.default_rng(1).permutation(cities)
    lines = [f"DIMENSION : {cities}", "EDGE_WEIGHT_TYPE : EUC_2D", "NODE_COORD_SECTION"]
    lines += [f"{number} {x[at]} {y[at]}" for number, at in enumerate(order, start=1)]

    path = folder / f"{name}.tsp"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_only_problems_of_50_to_80_cities_count(tmp_path: Path) -> None:
    _problem(tmp_path, "small", 20)
    _problem(tmp_path, "ring", 50)

    metrics = tours.measure_tsp(tmp_path, 1)

    assert metrics["tsp_problems"] == 1.0
    assert metrics["ring_optimum"] == 50 * 126
    assert metrics["hierarchical_above_optimum"] == 0.0
    assert "small_optimum" not in metrics


def test_the_optimum_is_that_of_the_tour_beside_the_problem(tmp_path: Path) -> None:
    _problem(tmp_path, "ring", 50)
    tour = ["DIMENSION : 50", "TOUR_SECTION", *(str(city) for city in range(1, 51)), "-1"]
    (tmp_path / "ring.opt.tour").write_text("\n".join(tour) + "\n")

    metrics = tours.measure_tsp(tmp_path, 1)

    assert metrics["ring_optimum"] > 50 * 126
    assert metrics["hierarchical_above_optimum"] < 0


def test_a_folder_without_problems_of_that_size_is_refused(tmp_path: Path) -> None:
    _problem(tmp_path, "small", 20)

    with pytest.raises(UsageError, match="no problem of 50 to 80 cities"):
        tours.measure_tsp(tmp_path, 1)


def test_the_command_measures_tours_without_a_grid(tmp_path: Path) -> None:
    _problem(tmp_path, "ring", 50)
    path = tmp_path / "tours.json"

    arguments = ["planning", "--tsp", str(tmp_path), "--processes", "1", "--json", str(path)]
    result = CliRunner().invoke(benchmarks, arguments)

    assert result.exit_code == 0, result.output
    metrics = json.loads(path.read_text())
    assert metrics["hierarchical_above_optimum"] <= metrics["flat_above_optimum"]
