"""The codelet of examples/ runs in the running system, installed as a package of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cogmap import ConfigError, Graph, InProcessRunner, Module, open_log, topics
from cogmap.bus.session import free_endpoint
from cogmap.schemas.nodes import Node
from cogmap.schemas.sensing import SelfMotion
from cogmap.services import registry
from tests.support.includes import ROOT

TIMEOUT_S = 90.0
SECTIONS: dict[str, dict[str, Any]] = {
    "run": {"lockstep": True, "participants": {"sim": 1}},
    "sim": {
        "frame_hz": 2,
        "trajectory": {
            "line_m": [[0.0, 0.0], [20.0, 0.0]],
            "landmarks": [{"name": "bakery", "x_m": 20.0, "y_m": 8.0}],
        },
    },
}
CONFIG = """\
[sim]
frame_hz = 2
[sim.trajectory]
line_m = [[0.0, 0.0], [20.0, 0.0]]
landmarks = [{ name = "bakery", x_m = 20.0, y_m = 8.0 }]
[trip]
min_speed_m_s = 0.5
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the example installed, as pip does it."""
    folder = tmp_path_factory.mktemp("codelet")
    source = folder / "source"
    target = folder / "site"
    shutil.copytree(ROOT / "examples" / "trip_codelet", source)
    options = ["--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--target", target]
    command = [sys.executable, "-m", "pip", "install", *options, source]
    subprocess.run(command, check=True, timeout=TIMEOUT_S)
    return target


@pytest.fixture
def installed(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets this process find the example's entry point."""
    monkeypatch.syspath_prepend(site)


def distance_m(graph: Graph) -> float:
    """What the codelet has written into the graph."""
    trip = graph.get(Node, "trip")
    assert trip is not None
    return float(trip.attributes["distance_m"])


def moved_m(motion: SelfMotion) -> float:
    """The distance that a self-motion states: its speeds times their durations."""
    rows = motion.motions.numpy()
    speed_m_s = rows[:, 0].astype(np.float64)
    duration_s = rows[:, 2].astype(np.float64)
    steps_m = np.abs(speed_m_s * duration_s)
    return float(steps_m.sum())


@pytest.mark.usefixtures("installed")
def test_the_codelet_sums_the_self_motion_in_one_process() -> None:
    graph = Graph()
    motions: list[SelfMotion] = []
    observer = Module("observer").following(graph).on(topics.SELF_MOTION, motions.append)
    modules = [registry.build(name, SECTIONS) for name in registry.MODULES]

    with InProcessRunner([*modules, observer]) as runner:
        runner.run()

    driven_m = sum(map(moved_m, motions))
    assert driven_m > 15
    assert distance_m(graph) == pytest.approx(driven_m)


@pytest.mark.usefixtures("installed")
def test_the_codelet_is_configured_as_ours_are() -> None:
    with pytest.raises(ConfigError, match=r"`trip\.min_speed_m_s`"):
        registry.build("codelets", {"trip": {"min_speed_m_s": -1.0}})


def test_without_the_package_there_is_no_such_section() -> None:
    with pytest.raises(ConfigError, match=r"unknown section \[trip\]"):
        registry.build("codelets", {"trip": {"min_speed_m_s": 1.0}})


def test_the_tests_of_the_package_pass(site: Path) -> None:
    command = [sys.executable, "-m", "pytest", "-q", "-c", "/dev/null", "-p", "no:cacheprovider"]
    run = subprocess.run(
        [*command, "--rootdir", ".", "test_trip_codelet.py"],
        check=False,
        cwd=site.parent / "source",
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(site), str(ROOT)])},
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
    )

    assert run.returncode == 0, run.stdout


def test_the_codelet_runs_in_processes(site: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    config = tmp_path / "trajectory.toml"
    config.write_text(CONFIG)
    command = [sys.executable, "-m", "cogmap.cli.main", "run", "--lockstep", "--config", config]
    options = ["--out", folder, "--connect", free_endpoint(), "--time-limit", "60"]

    run = subprocess.run(
        [*command, *options],
        check=False,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(site), str(ROOT)])},
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
    )
    assert run.returncode == 0, run.stdout + run.stderr

    log = open_log(folder / "log.mcap")
    assert log.config["trip"] == {"min_speed_m_s": 0.5}
    assert distance_m(log.graph_at(log.duration_s)) > 15
