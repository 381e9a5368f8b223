"""Messages lost in a minute of the whole system, as every subscriber and the recorder count them."""

from __future__ import annotations

from pathlib import Path

from benchmarks.drive import drive, recording
from schemas import topics
from schemas.topics import Delivery

RUN_S = 60.0
LAPS = 100.0


def measure(folder: Path) -> dict[str, float]:
    """Numbers of NEVER_DROP messages that were said, and that whoever missed most never got, over
    all topics.
    """
    _, watch = drive(folder, laps=LAPS, seconds=RUN_S)
    recorded = recording(folder)
    seen = watch.gaps()
    never = [topic.name for topic in topics.ALL if topic.delivery is Delivery.NEVER_DROP]
    counts = (seen, recorded.lost, recorded.unrecovered, recorded.dropped)
    lost = {name: max(count.get(name, 0) for count in counts) for name in never}
    return {
        "never_drop_lost": float(sum(lost.values())),
        "never_drop_messages": float(sum(recorded.messages.get(name, 0) for name in never)),
        "never_drop_run_s": watch.observer.elapsed_s,
    }
