"""The metrics of the message bus."""

from __future__ import annotations

import click

from benchmarks.benchmark import Setting
from benchmarks.bus import deltas, message_loss
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.bus.session import free_endpoint

THRESHOLDS = {"delta_rate_ratio": at_least(0.5), "never_drop_lost": at_most(0)}
DELTAS = 3000
PAIRS = 7
OPTIONS = (
    click.Option(
        ["--pairs"],
        type=click.IntRange(1, 99),
        default=PAIRS,
        show_default=True,
        help="How often to measure both rates, one right after the other; the ratio is the median.",
    ),
    click.Option(
        ["--deltas", "number"],
        type=click.IntRange(100, 100_000),
        default=DELTAS,
        show_default=True,
        help="Of each.",
    ),
)


def measure(setting: Setting, *, number: int = DELTAS, pairs: int = PAIRS) -> Metrics:
    """Measure the rate of committed deltas against raw Zenoh puts, and what is lost in a minute.

    A workspace commits deltas of 31 KB that three replicas receive, validate and apply; the peer
    puts the same bytes through the same router to three subscribers. Then the whole system drives
    for 60 s, recorded. Takes about two minutes.
    """
    rates = deltas.measure(free_endpoint(), number, pairs, setting.announce)

    setting.announce(f"driving for {message_loss.RUN_S:g} s, counting what is lost")
    return rates | message_loss.measure(setting.folder)
