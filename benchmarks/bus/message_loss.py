"""Messages lost in a minute of the whole system, by every subscriber's and the recorder's count."""

from __future__ import annotations

from pathlib import Path

from benchmarks.drive import drive, recording
from benchmarks.report import Metrics
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery

RUN_S = 60.0
LAPS = 100.0


def measure(folder: Path) -> Metrics:
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
