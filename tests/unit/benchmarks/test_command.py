"""The benchmarks' command and what it measures with, short of the minutes that they take."""

from __future__ import annotations

import json
import socket
from pathlib import Path

import pytest
from click.testing import CliRunner

from benchmarks import deltas
from benchmarks.__main__ import BUS_BARS, benchmarks
from benchmarks.cycle import BARS
from benchmarks.report import Bar, publish
from cogmap.bus.codec import encode
from schemas.graph import Links, Node
from services.workspace.commit import Ledger


def test_the_bars_are_those_of_the_keys_promised() -> None:
    bars = {name: str(bar) for name, bar in (BARS | BUS_BARS).items()}

    assert bars == {
        "cycle_p50_ms": "≤ 100",
        "cycle_p99_ms": "≤ 260",
        "bus_share": "≤ 0.25",
        "replay_speed": "≥ 5",
        "error_ratio": "≤ 0.33",
        "delta_rate_ratio": "≥ 0.5",
        "never_drop_lost": "≤ 0",
    }


def test_a_report_tells_what_is_met_and_missed_and_writes_flat_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "figures.json"

    publish("speed", {"low": 1.0, "high": 3.0, "why": 7.0}, {"low": Bar(2), "high": Bar(2)}, path)

    lines = {
        line.split()[1]: line
        for line in capsys.readouterr().out.splitlines()
        if line.startswith("│")
    }
    assert "met" in lines["low"]
    assert "missed" in lines["high"]
    assert "7" in lines["why"]
    assert json.loads(path.read_text()) == {"low": 1.0, "high": 3.0, "why": 7.0}


def test_a_typical_delta_has_50_nodes_200_links_and_31_kb() -> None:
    operations = deltas.typical_operations()
    links = [
        weights
        for part in operations
        if isinstance(part, Links)
        for weights in part.weights.values()
    ]

    assert sum(isinstance(part, Node) for part in operations) == 50
    assert sum(map(len, links)) == 200
    assert len(encode(Ledger(1.0).commit(0, 1, "objects", operations))) == pytest.approx(
        31_000, rel=0.02
    )


def test_every_delta_reaches_every_replica_and_both_rates_are_told() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"

    figures = deltas.measure(endpoint, number=100, pairs=1, tell=lambda sentence: None)

    assert figures["delta_rate_ratio"] == pytest.approx(
        figures["delta_rate_hz"] / figures["raw_put_rate_hz"]
    )
    assert min(figures.values()) > 0


@pytest.mark.parametrize("command", ["cycle", "bus"])
def test_a_folder_that_is_not_there_is_named_before_anything_is_measured(
    command: str, tmp_path: Path
) -> None:
    result = CliRunner().invoke(
        benchmarks, [command, "--json", str(tmp_path / "nowhere" / "figures.json")]
    )

    assert result.exit_code == 2
    assert "there is no folder" in result.output
