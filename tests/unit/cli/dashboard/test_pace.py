"""How often a page is told what is new."""

from __future__ import annotations

import pytest

from cogmap.cli.dashboard.pace import LONGEST_REST_MS, rest_ms


@pytest.mark.parametrize(
    ("idle", "expected_ms"),
    [(1.0, 0.0), (0.5, 0.0), (0.3, LONGEST_REST_MS / 2), (0.1, LONGEST_REST_MS), (0.0, 1000.0)],
)
def test_a_page_rests_the_longer_the_busier_the_machine_is(idle: float, expected_ms: float) -> None:
    assert rest_ms(idle) == pytest.approx(expected_ms)
