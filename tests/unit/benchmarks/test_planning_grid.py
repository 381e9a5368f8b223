"""The planning benchmark on a small grid with a wall."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from benchmarks.commands import benchmarks
from benchmarks.planning.grid import measure
from cogmap.errors import UsageError

MAP = "type octile\nheight 3\nwidth 5\nmap\n..@..\n..@..\n.....\n"


def _files(folder: Path, *problems: str) -> tuple[Path, Path]:
    map_path = folder / "a.map"
    scenario_path = folder / "a.scen"
    map_path.write_text(MAP)
    lines = [f"0\ta.map\t5\t3\t{problem}" for problem in problems]
    scenario_path.write_text("\n".join(["version 1", *lines]) + "\n")
    return map_path, scenario_path


def test_routes_are_compared_with_the_optimal_lengths(tmp_path: Path) -> None:
    stated = 5.0
    files = _files(tmp_path, f"1\t1\t3\t1\t{stated}", "0\t0\t0\t0\t0")

    metrics = measure(*files)

    assert metrics["problems"] == 2
    assert metrics["solved_share"] == 1
    assert metrics["flat_over_optimal"] == pytest.approx(4 / stated)
    assert metrics["hierarchical_over_optimal"] >= metrics["flat_over_optimal"] - 1e-9
    assert metrics["time_vs_dijkstra"] > 0
    assert metrics["hierarchical_speedup"] > 0


def test_a_scenario_of_another_map_is_refused(tmp_path: Path) -> None:
    map_path, scenario_path = _files(tmp_path, "2\t0\t3\t1\t4")

    with pytest.raises(UsageError, match="passable cell"):
        measure(map_path, scenario_path)


@pytest.mark.parametrize("given", [[], ["--grid", "a.map"], ["--scen", "a.scen"]])
def test_a_map_without_its_problems_is_refused(given: list[str]) -> None:
    result = CliRunner().invoke(benchmarks, ["planning", *given])

    assert result.exit_code == 2
    assert "--grid and --scen" in result.output
