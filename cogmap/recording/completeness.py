"""What the logs of a run lack: of all of them together, also at the boundary between two."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cogmap.bus.codec import Envelope
from cogmap.errors import LogError
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.reader import LogReader, Progress
from cogmap.recording.storage.sequences import SequenceTracker
from cogmap.schemas import topics
from cogmap.schemas.topics import BY_NAME, Delivery, Topic

log = logging.getLogger("cogmap")
NEVER_DROP = tuple(topic for topic in topics.ALL if topic.delivery is Delivery.NEVER_DROP)
Published = Mapping[str, Mapping[str, int]]
"""How many messages each instance has published in all its incarnations, by topic."""


@dataclass
class Completeness:
    """How many NEVER_DROP messages are in no log: `lost`, by topic, and sentences about them.
    `messages` are those that were read.
    """

    lost: dict[str, int] = field(default_factory=dict)
    gaps: list[str] = field(default_factory=list)
    messages: int = 0

    def compare(self, reached: Mapping[str, Mapping[str, int]], published: Published) -> None:
        """Add the messages that instances published after the last one of theirs in the logs, which
        have `reached` so many of each topic and source.
        """
        for instance, counts in published.items():
            for name, count in counts.items():
                in_logs = reached.get(name, {}).get(instance, 0)
                missing = count - in_logs
                if missing <= 0 or name not in BY_NAME or not BY_NAME[name].keep_in_log:
                    continue
                self.lost[name] = self.lost.get(name, 0) + missing
                kind = Delivery.NEVER_DROP.value
                self.gaps.append(f"{name} ({kind}): the last {missing} of {instance} missing")


def never_drop(lost: Mapping[str, int]) -> dict[str, int]:
    """Return those of the counts by topic that are of NEVER_DROP topics."""
    return {
        name: count for name, count in lost.items() if BY_NAME[name].delivery is Delivery.NEVER_DROP
    }


def logs_of(folder: Path) -> list[Path]:
    """Return the logs in a run's folder, in the order in which they were begun."""
    first = folder / layout.LOG_NAME
    found = [first] if first.exists() else []
    later = folder.glob(f"{first.stem}-*{first.suffix}")
    numbers = {path: path.stem.removeprefix(f"{first.stem}-") for path in later}
    numbered = [path for path, number in numbers.items() if number.isdecimal()]
    return [*found, *sorted(numbered, key=lambda path: int(numbers[path]))]


def began_ns(paths: Sequence[Path], default_ns: int) -> int:
    """Return when the first of the logs was begun, `default_ns` if that cannot be read."""
    for path in paths:
        try:
            return int(LogReader(path).about(layout.RECORDING).get("began_ns", default_ns))
        except (LogError, ValueError):
            continue
    return default_ns


def sequence_of(
    paths: Sequence[Path], progress: Progress | None = None
) -> Iterator[tuple[Topic, Envelope]]:
    """Yield topic and envelope of each NEVER_DROP message in the logs, oldest first. A log that
    cannot be read is named, and left out.
    """
    for number, path in enumerate(paths):

        def show(share: float, done: int = number) -> None:
            if progress is not None:
                progress((done + share) / len(paths))

        try:
            for record in LogReader(path).records(NEVER_DROP, show):
                if record.envelope is not None:
                    yield record.topic, record.envelope
        except LogError as error:
            log.warning("%s", error)


def completeness(
    paths: Sequence[Path], published: Published, progress: Progress | None = None
) -> Completeness:
    """Read what the logs of a run lack, of what was `published` too."""
    sequences = SequenceTracker(since_ns=began_ns(paths, 0))
    messages = 0
    for topic, envelope in sequence_of(paths, progress):
        sequences.follow(topic, envelope)
        messages += 1

    found = Completeness(never_drop(sequences.lost()), sequences.gaps(), messages)
    found.compare(sequences.reached(), published)
    return found
