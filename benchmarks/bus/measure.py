"""The metrics of the message bus."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from benchmarks.bus import deltas, message_loss
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.bus.session import free_endpoint

THRESHOLDS = {"delta_rate_ratio": at_least(0.5), "never_drop_lost": at_most(0)}
DELTAS = 3000
PAIRS = 7


def measure(
    folder: Path,
    announce: Callable[[str], None],
    number: int = DELTAS,
    pairs: int = PAIRS,
) -> Metrics:
    """The rate of `number` committed deltas against raw puts, in `pairs` of runs, and what is lost.

    `folder` holds the files of the drive that counts losses.
    """
    rates = deltas.measure(free_endpoint(), number, pairs, announce)

    announce(f"driving for {message_loss.RUN_S:g} s, counting what is lost")
    losses = message_loss.measure(folder)

    return rates | losses
