"""Benchmarks that drive towns do so in as many processes as there are, or in one."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.benchmark import Setting
from benchmarks.cycle import position_error
from benchmarks.individuals import measure as individuals
from benchmarks.individuals.visitor import Plan
from cogmap.recording.storage.reader import LogReader
from cogmap.schemas import topics


def test_one_process_drives_one_town_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(position_error, "TOWNS", (1, 2))
    monkeypatch.setattr(position_error, "LAPS", 0.05)

    metrics = position_error.over_fused(processes=1)

    ratios = [metrics[f"error_over_fused_town_{town}"] for town in (1, 2)]
    assert metrics["error_over_fused"] == pytest.approx(sum(ratios) / 2)
    assert metrics["wheels_error_m"] > 0


def test_a_town_of_each_kind_is_visited_and_its_log_kept(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(individuals, "PLANS", dict.fromkeys(individuals.PLANS, Plan(explore_s=4.0)))
    said: list[str] = []
    setting = Setting(tmp_path, processes=1, announce=said.append)

    measured = individuals.measure(setting, towns=1, first_seed=2, folder=tmp_path / "logs")

    assert measured.keys() >= individuals.THRESHOLDS.keys()
    assert len(said) == len(individuals.PLANS)
    log = LogReader(tmp_path / "logs" / "never_taught-2.mcap")
    assert sum(1 for _ in log.records([topics.PERCEPTS])) == 20
