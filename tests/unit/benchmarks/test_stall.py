"""When a recorder that was stopped has everything again."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.stall.measure import has_caught_up, last_of_those_that_grew
from benchmarks.stall.witness import Stream
from tests.support.logs import delta, write_log

DELTAS: Stream = ("workspace/delta", "workspace", 1)
PERCEPTS: Stream = ("epam/percepts", "epam", 1)
STOPPED_NS = 10
CONTINUED_NS = 20


def test_what_came_during_a_stop_is_awaited_of_each_stream_that_had_any() -> None:
    before = {DELTAS: {1, 2}, PERCEPTS: {7}}
    after = {DELTAS: {1, 2, 3, 4}, PERCEPTS: {7}}

    assert last_of_those_that_grew(before, after) == {DELTAS: 4}
    assert last_of_those_that_grew({}, after) == {DELTAS: 4, PERCEPTS: 7}


@pytest.mark.parametrize(
    ("versions", "whole"),
    [
        pytest.param([], False, id="nothing-has-come"),
        pytest.param([3], False, id="some-has-come"),
        pytest.param([3, 4], True, id="all-has-come"),
        pytest.param([3, 4, 5], True, id="more-has-come"),
    ],
)
def test_a_log_is_whole_once_it_has_what_was_awaited(
    tmp_path: Path, versions: list[int], whole: bool
) -> None:
    recorded = [(STOPPED_NS - 2, delta(1)), (STOPPED_NS - 1, delta(2))]
    fetched = [(CONTINUED_NS + version, delta(version)) for version in versions]
    log = write_log(tmp_path / "log.mcap", [*recorded, *fetched])

    assert has_caught_up(log, {DELTAS: 4}, CONTINUED_NS) is whole
