"""The metrics of the message bus."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.benchmark import Setting
from benchmarks.bus import deltas
from benchmarks.drive import drive, recording
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.bus.session import free_endpoint
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery

THRESHOLDS = {"delta_rate_ratio": at_least(0.5), "never_drop_lost": at_most(0)}
DELTAS = 3000
PAIRS = 7
RUN_S = 60.0
LAPS = 100.0
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

    A workspace commits deltas of 32 KB that three replicas receive, validate and apply; the peer
    puts the same bytes through the same router to three subscribers. Then the whole system drives
    for 60 s, recorded. Takes about two minutes.
    """
    rates = deltas.measure(free_endpoint(), number, pairs, setting.announce)

    setting.announce(f"driving for {RUN_S:g} s, counting what is lost")
    return rates | message_loss(setting.folder)


def message_loss(folder: Path) -> Metrics:
    """Count the NEVER_DROP messages published, and those that the worst receiver never got.

    A topic's loss is the largest that any subscriber counted. `folder` holds the drive's files.
    """
    _, watch = drive(folder, laps=LAPS, seconds=RUN_S)
    recorded = recording(folder)
    counts = (watch.gaps(), recorded.lost, recorded.unrecovered, recorded.dropped)
    lost = 0
    published = 0

    for topic in topics.ALL:
        if topic.delivery is not Delivery.NEVER_DROP:
            continue
        lost += max(count.get(topic.name, 0) for count in counts)
        published += recorded.messages.get(topic.name, 0)

    return {
        "never_drop_lost": float(lost),
        "never_drop_messages": float(published),
        "never_drop_run_s": watch.tally.observer.elapsed_s,
    }
