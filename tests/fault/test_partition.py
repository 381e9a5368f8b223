"""The router is away for a moment, for modules with a bad link and for others: nothing is lost."""

from __future__ import annotations

from pathlib import Path

from benchmarks.benchmark import Setting
from benchmarks.partition import measure as partition


def test_nothing_is_lost_over_bad_links_or_while_the_router_is_away(tmp_path: Path) -> None:
    setting = Setting(tmp_path, 1, lambda sentence: None)

    metrics = partition.measure(setting, away_s=(1.0,), seconds=2.0, time_limit_s=120.0)

    assert metrics["undelivered"] == 0
    assert metrics["unreported"] == 0
    assert metrics["published"] > 0
