"""`cogmap experiment` as users run it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from cogmap.cli.experiment import live
from cogmap.experiments.loop_closing.run import MODULES, driven, sections
from cogmap.services import registry

COGMAP = [sys.executable, "-m", "cogmap.cli.main", "experiment"]
TIMEOUT_S = 110.0
LOOP_M = [(0.0, 0.0), (60.0, 0.0), (60.0, 40.0), (0.0, 40.0), (0.0, 0.0), (60.0, 0.0)]


def _run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COGMAP, *arguments], capture_output=True, text=True, timeout=TIMEOUT_S, check=False
    )


def test_cue_integration_gives_the_same_bytes_through_real_processes(
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    chosen = tmp_path / "cue.json"
    options = ("--trials", "8", "--seeds", "1", "--live", "--seed", "3")

    done = _run("cue-integration", *options, "--out", str(out), "--json", str(chosen))
    assert done.returncode == 0, done.stdout + done.stderr

    metrics = json.loads(chosen.read_text())
    assert metrics["live_same"] == 1.0
    assert metrics["seed"] == 3
    assert "cue-integration --trials 8" in metrics["command"]
    assert metrics["both_sd_m"] < metrics["self_motion_sd_m"]
    assert metrics == json.loads((out / "cue-integration.json").read_text())
    assert (out / "cue-integration.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "cue-integration.pdf").read_bytes().startswith(b"%PDF")


def test_a_json_file_in_no_folder_is_one_sentence_and_code_2(tmp_path: Path) -> None:
    path = tmp_path / "nowhere" / "cue.json"

    done = _run("cue-integration", "--json", str(path))

    assert done.returncode == 2
    assert "there is no folder" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_loop_is_closed_with_the_same_bytes_through_real_processes() -> None:
    configured = sections(1, "heading")
    configured["sim"]["trajectory"]["line_m"] = LOOP_M
    modules = [registry.build(name, configured) for name in MODULES]

    assert driven(configured, modules).replays
    assert live.differing(configured, MODULES) == []


def test_route_planning_compares_people_the_model_and_the_shortest_tours(tmp_path: Path) -> None:
    out = tmp_path / "out"
    tours = _people_tours(tmp_path)
    options = ("--drawn", "1", "--participants", "3", "--max-goals", "30")

    done = _run("route-planning", "--data", str(tours), *options, "--out", str(out))
    assert done.returncode == 0, done.stdout + done.stderr

    metrics = json.loads((out / "route-planning.json").read_text())
    assert metrics["within_iqr_share_in_sample"] == 1.0
    assert metrics["graph0_people_above_optimum_quartile_1"] == 0.0
    assert metrics["graph0_people_above_optimum_quartile_3"] > 0.0
    assert metrics["goals_030_hierarchical_above_optimum"] < metrics["goals_030_flat_above_optimum"]
    assert "±0.2" in metrics["published_of_4_to_9_goals"]
    assert (out / "route-planning.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "route-planning.pdf").read_bytes().startswith(b"%PDF")


def test_sub_maps_of_a_city_are_drawn_and_described(tmp_path: Path) -> None:
    out = tmp_path / "out"
    city = _city(tmp_path / "city.osm")

    done = _run("map-structure", "--osm", str(city), "--out", str(out))
    assert done.returncode == 0, done.stdout + done.stderr

    metrics = json.loads((out / "map-structure.json").read_text())
    assert metrics["city_objects"] == 48.0
    assert metrics["city_sub_maps"] >= 1.0
    assert (out / "map-structure.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "map-structure.pdf").read_bytes().startswith(b"%PDF")


def _city(path: Path) -> Path:
    """48 shops in rows, and a street."""
    nodes = []
    for number in range(48):
        row, column = divmod(number, 8)
        place = f'lon="{column * 2e-4:.6f}" lat="{row * 2e-4:.6f}"'
        nodes.append(f'<node id="{number + 1}" {place}><tag k="shop" v="books"/></node>')

    street = '<way id="90"><nd ref="1"/><nd ref="8"/><tag k="highway" v="residential"/></way>'
    path.write_text("\n".join(['<osm version="0.6">', *nodes, street, "</osm>"]))
    return path


def _people_tours(folder: Path) -> Path:
    """A square that four people drew a tour of, two of them across."""
    (folder / "Graph0.lib").write_text(
        "DIMENSION : 4\nEDGE_WEIGHT_TYPE : EUC_2D\nNODE_COORD_SECTION\n1 0 0\n2 0 9\n3 9 9\n4 9 0\n"
    )
    around = '"0,0,9,9","0,9,9,0"'
    across = '"0,9,0,9","0,9,9,0"'
    rows = [f"0,{person},{tour}" for person, tour in enumerate([around, around, across, across])]
    (folder / "tours.csv").write_text("\n".join(["graph,participant,x,y", *rows]) + "\n")
    return folder
