"""Figures that `cogmap topic hz`, `bw` and `delay` print."""

from __future__ import annotations

import pytest

from cogmap.cli.topic.metrics import in_bytes
from cogmap.cli.topic.statistics import Bandwidth, Delay, Rate

S = 1_000_000_000


def test_a_rate_needs_two_messages() -> None:
    rate = Rate(10)
    assert rate.periods_s() is None

    rate.add(0)
    assert rate.periods_s() is None


def test_a_rate_is_that_of_the_last_messages() -> None:
    rate = Rate(2)
    for at_ns in (0, 5 * S, 6 * S, 8 * S):
        rate.add(at_ns)

    spread = rate.periods_s()

    assert spread is not None
    assert (spread.mean, spread.least, spread.greatest, spread.deviation, spread.window) == (
        1.5,
        1.0,
        2.0,
        0.5,
        2,
    )


def test_bandwidth_is_what_came_over_the_time_since_the_first_of_it() -> None:
    bandwidth = Bandwidth(3)
    for at_s, size in ((0, 9999), (1, 100), (2, 200), (3, 300)):
        bandwidth.add(at_s * S, size)

    sizes = bandwidth.sizes_bytes()

    assert bandwidth.bytes_per_s(5 * S) == pytest.approx(150.0)
    assert sizes is not None
    assert sizes.mean == 200.0
    assert sizes.least == 100.0
    assert sizes.greatest == 300.0
    assert sizes.window == 3


def test_without_messages_there_is_no_bandwidth() -> None:
    bandwidth = Bandwidth(3)

    assert bandwidth.bytes_per_s(S) == 0.0
    assert bandwidth.sizes_bytes() is None


def test_a_delay_counts_from_the_sensing_and_tells_where_the_time_went() -> None:
    delay = Delay(10)
    delay.add(0, 3 * S, 4 * S, [("sensory", S, S), ("epam", S, 0)])
    delay.add(S, 5 * S, 7 * S, [("sensory", 3 * S, S)])
    ages = delay.ages_s()
    last_leg = delay.last_leg_s()

    assert ages is not None
    assert ages.mean == 5.0
    assert last_leg is not None
    assert last_leg.mean == 1.5
    assert delay.stages_s() == {"sensory": (2.0, 1.0), "epam": (1.0, 0.0)}


@pytest.mark.parametrize(
    ("size", "text"),
    [(0, "0 B"), (999, "999 B"), (1500, "1.50 KB"), (31e6, "31.00 MB"), (7e12, "7000.00 GB")],
)
def test_sizes_have_a_unit_that_fits(size: float, text: str) -> None:
    assert in_bytes(size) == text
