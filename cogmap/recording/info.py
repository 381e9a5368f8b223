"""What is in a log: how long, how big, how much of what, and whether it is complete."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from cogmap.recording.log import recorded_config
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.reader import LogReader, Progress, Record
from cogmap.recording.storage.sequences import SequenceTracker
from cogmap.schemas.topics import BY_NAME


class TopicInfo(msgspec.Struct, kw_only=True):
    """One topic: its messages by source, their rate over the log's duration, and how many numbers
    are missing.
    """

    topic: str
    type: str
    delivery: str
    count: int
    rate_hz: float
    mean_bytes: float
    lost: int
    sources: dict[str, int]


class Info(msgspec.Struct, kw_only=True):
    """A log. `cut_bytes` at its end cannot be read; `finished` is whether its recorder ended it.

    `gaps` are sentences. `unknown` are topics in it that are not in the table.
    """

    path: str
    software: str
    agent: str
    began_ns: int
    duration_s: float
    size_bytes: int
    messages: int
    finished: bool
    cut_bytes: int
    gaps: list[str]
    unknown: list[str]
    config: dict[str, Any]
    topics: list[TopicInfo]


@dataclass
class _Tally:
    """The messages of one topic."""

    count: int = 0
    size: int = 0
    sources: Counter[str] = field(default_factory=Counter)

    def add(self, record: Record) -> None:
        envelope = record.envelope
        source = "?" if envelope is None else envelope.source
        self.count += 1
        self.size += record.size
        self.sources[source] += 1


def info(path: Path, progress: Progress | None = None) -> Info:
    """Read what is in the log at `path`. Raises LogError."""
    reader = LogReader(path)
    recording = reader.about(layout.RECORDING)
    # Metadata have no checksum: the time may be none.
    began = recording.get("began_ns", "")
    began_ns = int(began) if began.isdecimal() else 0
    sequences = SequenceTracker(since_ns=began_ns or None)

    recorded = {channel.topic for channel in reader.channels.values()}
    tallies = {name: _Tally() for name in recorded if name in BY_NAME}
    for record in reader.records(progress=progress):
        tallies.setdefault(record.topic_name, _Tally()).add(record)
        if record.envelope is not None:
            sequences.follow(record.topic, record.envelope)

    lost = sequences.lost()
    duration_s = reader.span_s
    rows = []
    for channel in reader.channels.values():
        tally = tallies.pop(channel.topic, None)
        if tally is None:
            continue
        topic = BY_NAME[channel.topic]
        rows.append(
            TopicInfo(
                topic=topic.name,
                type=topic.type.__name__,
                delivery=topic.delivery.value,
                count=tally.count,
                rate_hz=tally.count / duration_s if duration_s > 0 else 0.0,
                mean_bytes=tally.size / tally.count if tally.count else 0.0,
                lost=lost.get(topic.name, 0),
                sources=dict(sorted(tally.sources.items())),
            )
        )

    return Info(
        path=str(path),
        software=recording.get("software", ""),
        agent=recording.get("agent", ""),
        began_ns=began_ns or reader.span_ns[0],
        duration_s=duration_s,
        size_bytes=reader.size_bytes,
        messages=sum(row.count for row in rows),
        finished=bool(reader.about(layout.SUMMARY)),
        cut_bytes=reader.cut_bytes,
        gaps=sequences.gaps(),
        unknown=sorted(recorded - {*BY_NAME, layout.ENVELOPES}),
        config=recorded_config(reader),
        topics=rows,
    )
