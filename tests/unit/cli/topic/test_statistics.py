"""Statistics that `cogmap topic hz`, `bw` and `delay` print."""

from __future__ import annotations

import pytest

from cogmap.bus.codec import Envelope, Stage
from cogmap.bus.interface import Arrival
from cogmap.cli.topic.observing import Reception
from cogmap.cli.topic.statistics import Bandwidth, Delay, Rate, in_bytes
from cogmap.schemas import topics

S = 1_000_000_000


def received(at_ns: int, size: int = 0, envelope: Envelope | None = None) -> Reception:
    return Reception(Arrival(topics.ODOMETRY, bytes(size), envelope, at_ns))


def sent(born_ns: int, sent_ns: int, stages: list[Stage]) -> Envelope:
    return Envelope("sim", 0, 0, sent_ns, born_ns, stages)


def test_a_rate_needs_two_messages() -> None:
    rate = Rate(10)
    assert rate.periods_s() is None

    rate.add(received(0))
    assert rate.periods_s() is None


def test_a_rate_is_that_of_the_last_messages() -> None:
    rate = Rate(2)
    for at_ns in (0, 5 * S, 6 * S, 8 * S):
        rate.add(received(at_ns))

    spread = rate.periods_s()

    assert spread is not None
    assert (spread.mean, spread.least, spread.greatest, spread.deviation, spread.window) == (
        1.5,
        1.0,
        2.0,
        0.5,
        2,
    )


def test_bandwidth_is_what_came_after_the_first_message_over_the_time_since_then() -> None:
    bandwidth = Bandwidth(3)
    for at_s, size in ((0, 9999), (1, 100), (2, 200), (3, 300)):
        bandwidth.add(received(at_s * S, size))

    sizes = bandwidth.sizes_bytes()

    assert bandwidth.bytes_per_s() == pytest.approx(250.0)
    assert sizes is not None
    assert sizes.mean == 200.0
    assert sizes.least == 100.0
    assert sizes.greatest == 300.0
    assert sizes.window == 3


def test_a_bandwidth_needs_two_messages() -> None:
    bandwidth = Bandwidth(3)
    assert bandwidth.bytes_per_s() is None
    assert bandwidth.sizes_bytes() is None

    bandwidth.add(received(0, 337))
    assert bandwidth.bytes_per_s() is None
    assert bandwidth.text() == ""

    bandwidth.add(received(5 * S // 2, 337))
    assert bandwidth.bytes_per_s() == pytest.approx(0.4 * 337)


def test_a_delay_counts_from_the_sensing_and_shows_where_the_time_went() -> None:
    delay = Delay(10)
    delay.add(received(4 * S, envelope=sent(0, 3 * S, [("sensory", S, S), ("epam", S, 0)])))
    delay.add(received(7 * S, envelope=sent(S, 5 * S, [("sensory", 3 * S, S)])))
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
