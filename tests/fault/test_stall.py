"""A recorder is stopped for a moment while an agent drives: it gets everything again."""

from __future__ import annotations

from pathlib import Path

from benchmarks.benchmark import Setting
from benchmarks.stall import measure as stall


def test_a_stopped_recorder_of_a_drive_has_every_message_in_the_end(tmp_path: Path) -> None:
    setting = Setting(tmp_path, 1, lambda sentence: None)

    metrics = stall.measure(setting, stops_s=(2.0,), time_limit_s=120.0)

    assert metrics["stop_2s_missed"] > 0
    assert metrics["lost"] == 0
    assert metrics["unsaid"] == 0
