"""The benchmark of the cycle drives its towns in as many processes as there are, or in one."""

from __future__ import annotations

import pytest

from benchmarks.cycle import position_error


def test_one_process_drives_one_town_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(position_error, "TOWNS", (1, 2))
    monkeypatch.setattr(position_error, "LAPS", 0.05)

    metrics = position_error.over_fused(processes=1)

    ratios = [metrics[f"error_over_fused_town_{town}"] for town in (1, 2)]
    assert metrics["error_over_fused"] == pytest.approx(sum(ratios) / 2)
    assert metrics["wheels_error_m"] > 0
