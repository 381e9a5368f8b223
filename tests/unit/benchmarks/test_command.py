"""The benchmarks' commands and what they measure with, short of the minutes that they take."""

from __future__ import annotations

import json
import os
import signal
import socket
import time
from pathlib import Path

import cv2
import pytest
from click.testing import CliRunner
from msgspec.structs import replace

from benchmarks import suite, timing
from benchmarks.benchmark import Benchmark, Setting
from benchmarks.bus import deltas
from benchmarks.bus import measure as bus
from benchmarks.commands import benchmarks
from benchmarks.cycle import measure as cycle
from benchmarks.cycle.ten_hertz import superseded_share
from benchmarks.report import Metrics, Outcome, report
from benchmarks.threshold import Threshold, at_least, at_most, less_than, more_than, within
from cogmap.bus.codec import encode
from cogmap.errors import UsageError
from cogmap.parallel import parallel_map
from cogmap.schemas.examples import example_messages
from cogmap.schemas.graph import Links
from cogmap.schemas.nodes import GraphNode
from cogmap.schemas.process import Health
from cogmap.services.workspace.commit import Ledger


def test_the_thresholds_are_those_of_the_keys_promised() -> None:
    thresholds = {key: str(limit) for key, limit in (cycle.THRESHOLDS | bus.THRESHOLDS).items()}

    assert thresholds == {
        "cycle_p50_ms": "≤ 60",
        "cycle_p99_ms": "≤ 130",
        "bus_share": "≤ 0.25",
        "start_s": "≤ 3",
        "cycle_p50_ms_10hz": "≤ 60",
        "superseded_share": "≤ 0.01",
        "replay_speed": "≥ 8",
        "error_ratio": "≤ 0.15",
        "error_over_fused": "≤ 0.6",
        "delta_rate_ratio": "≥ 0.5",
        "never_drop_lost": "≤ 0",
    }


@pytest.mark.parametrize(
    ("threshold", "met", "missed"),
    [
        (at_most(2), 2.0, 2.1),
        (at_least(2), 2.0, 1.9),
        (more_than(0), 0.1, 0.0),
        (less_than(1), 0.9, 1.0),
        (within(0.9, 1.1), 0.9, 1.2),
        (at_most(2), 0.0, float("nan")),
    ],
    ids=["at most", "at least", "more than", "less than", "within", "not a number"],
)
def test_a_threshold_is_met_up_to_its_limits_and_by_no_nan(
    threshold: Threshold, met: float, missed: float
) -> None:
    assert threshold.is_met(met)
    assert not threshold.is_met(missed)


def test_a_report_shows_what_is_met_and_missed_and_writes_flat_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "metrics.json"
    thresholds = {"low": at_most(2), "high": at_most(2)}

    report(Outcome("speed", thresholds, {"low": 1.0, "high": 3.0, "why": 7.0}), path)

    lines = {
        line.split()[1]: line
        for line in capsys.readouterr().out.splitlines()
        if line.startswith("│")
    }

    assert "met" in lines["low"]
    assert "missed" in lines["high"]
    assert "7" in lines["why"]
    assert json.loads(path.read_text()) == {"low": 1.0, "high": 3.0, "why": 7.0}


def _slow(setting: Setting) -> Metrics:
    return {"slow_ms": 3.0, "runs": 2.0}


def _fast(setting: Setting) -> Metrics:
    return {"fast_ms": 1.0, "runs": 5.0}


def _refused(setting: Setting) -> Metrics:
    raise UsageError("gtsam is not installed")


def _failing(setting: Setting) -> Metrics:
    raise ZeroDivisionError("nothing was measured")


def _crashing(setting: Setting) -> Metrics:
    os.kill(os.getpid(), signal.SIGSEGV)
    return {}


def _parallel(setting: Setting) -> Metrics:
    return {"total": float(sum(parallel_map(abs, [-1, 2], 2)))}


def _silent(sentence: str) -> None:
    """Announces nothing."""


def _suite(monkeypatch: pytest.MonkeyPatch, *more: Benchmark) -> None:
    """Replace the minutes of the real suite by benchmarks that return at once."""
    benchmarks_there = (
        Benchmark("cycle", {"slow_ms": at_most(2)}, _slow),
        Benchmark("bus", {"fast_ms": at_most(2)}, _fast),
        *more,
    )
    monkeypatch.setattr(suite, "SUITE", benchmarks_there)


def test_all_ends_with_1_where_a_threshold_is_missed_and_writes_every_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _suite(monkeypatch)
    path = tmp_path / "all.json"

    result = CliRunner().invoke(benchmarks, ["all", "--json", str(path)])

    assert result.exit_code == 1
    assert "missed" in result.output

    metrics = json.loads(path.read_text())
    assert metrics["slow_ms"] == 3.0
    assert metrics["fast_ms"] == 1.0
    assert metrics["runs"] == 2.0
    assert metrics["bus_runs"] == 5.0
    assert metrics["machine_unit_ms"] > 0


def test_all_ends_with_0_where_every_threshold_chosen_is_met(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _suite(monkeypatch)
    one = CliRunner().invoke(benchmarks, ["all", "--only", "bus"])
    all_but_one = CliRunner().invoke(benchmarks, ["all", "--skip", "cycle"])

    assert one.exit_code == 0
    assert all_but_one.exit_code == 0


def test_a_benchmark_that_fails_is_a_row_with_its_reason_and_others_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _suite(
        monkeypatch,
        Benchmark("localization", {"rmse_m": at_most(1)}, _refused),
        Benchmark("spiking", {}, _failing),
        Benchmark("camvid", {}, _crashing),
    )
    path = tmp_path / "all.json"
    arguments = ["all", "--skip", "cycle", "--json", str(path)]

    result = CliRunner().invoke(benchmarks, arguments, env={"COLUMNS": "200"})

    assert result.exit_code == 1
    assert "gtsam is not installed" in result.output
    assert "ZeroDivisionError: nothing was measured" in result.output
    assert "its process died" in result.output
    assert json.loads(path.read_text())["fast_ms"] == 1.0


def test_a_benchmark_ends_with_the_processes_that_it_used(tmp_path: Path) -> None:
    outcome = suite.run(
        Benchmark("spiking", {}, _parallel),
        Setting(tmp_path, 2, _silent),
        None,
    )

    assert outcome.metrics["total"] == 3.0


def test_a_benchmark_of_a_set_that_is_not_there_names_its_folder(tmp_path: Path) -> None:
    outcome = suite.run(
        next(each for each in suite.SUITE if each.name == "cones"),
        Setting(tmp_path, 1, _silent),
        tmp_path,
    )

    assert f"there is no folder {tmp_path / 'stereo_cones'}" in outcome.failure


def test_all_benchmarks_thresholds_have_keys_of_their_own_in_one_file() -> None:
    outcomes = []
    for benchmark in suite.SUITE:
        metrics = dict.fromkeys(benchmark.thresholds, 0.0)
        outcomes.append(Outcome(benchmark.name, benchmark.thresholds, metrics))

    written = suite.merged(outcomes)

    assert len(written) == sum(len(benchmark.thresholds) for benchmark in suite.SUITE)
    assert {"incremental_ms_p99", "map_structure_incremental_ms_p99"} <= written.keys()


def test_the_unit_of_a_machine_leaves_the_threads_of_opencv_as_they_were() -> None:
    threads = cv2.getNumThreads()

    unit_ms = timing.machine_unit_ms()

    assert unit_ms > 0
    assert cv2.getNumThreads() == threads


def test_the_least_cpu_time_does_not_count_a_call_that_took_longer() -> None:
    busy_s = iter([1.0, 0.0, 1.0])

    def work() -> None:
        ends_s = time.process_time() + next(busy_s)
        while time.process_time() < ends_s:
            pass

    assert timing.least_cpu_s(work, rounds=3) < 1.0


def test_a_typical_delta_has_50_nodes_200_links_and_32_kb() -> None:
    operations = deltas.typical_operations()
    links = [
        weights
        for part in operations
        if isinstance(part, Links)
        for weights in part.weights.values()
    ]

    assert sum(isinstance(part, GraphNode) for part in operations) == 50
    assert sum(map(len, links)) == 200
    assert len(encode(Ledger(1.0).commit(0, 1, "objects", operations))) == pytest.approx(
        32_350, rel=0.02
    )


def test_every_delta_reaches_every_replica_and_both_rates_are_measured() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"

    metrics = deltas.measure(endpoint, number=100, pairs=1, announce=lambda sentence: None)

    assert metrics["delta_rate_ratio"] == pytest.approx(
        metrics["delta_rate_hz"] / metrics["raw_put_rate_hz"]
    )
    assert min(metrics.values()) > 0


@pytest.mark.parametrize("command", ["cycle", "bus"])
def test_a_folder_that_is_not_there_is_named_before_anything_is_measured(
    command: str, tmp_path: Path
) -> None:
    result = CliRunner().invoke(
        benchmarks, [command, "--json", str(tmp_path / "nowhere" / "metrics.json")]
    )

    assert result.exit_code == 2
    assert "there is no folder" in result.output


def _health(
    instance: str, emitted: dict[str, int], superseded: dict[str, int] | None = None
) -> Health:
    (example,) = [message for message in example_messages() if isinstance(message, Health)]
    return replace(example, instance=instance, emitted=emitted, superseded=superseded or {})


def test_frames_and_views_count_as_superseded_and_scans_do_not() -> None:
    health = {
        "sim": _health("sim", {"camera/stereo": 200}),
        "sensory": _health("sensory", {"sensory/view": 199}, {"camera/stereo": 1}),
        "epam": _health("epam", {}, {"sensory/view": 3}),
        "motor": _health("motor", {}, {"sensory/scan": 50}),
    }

    assert superseded_share(health) == pytest.approx(0.02)
