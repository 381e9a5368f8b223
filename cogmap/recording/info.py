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
    """What is in the log at `path`. Raises LogError."""
    reader = LogReader(path)
    recording = reader.about(layout.RECORDING)
    began_ns = _time_ns(recording.get("began_ns", ""))
    sequences = SequenceTracker(since_ns=began_ns or None)
    tallies = _tallies(reader, sequences, progress)
    lost = sequences.lost()

    rows = []
    for name, tally in tallies.items():
        rows.append(_topic(name, tally, reader.span_s, lost.get(name, 0)))
    return Info(
        path=str(path),
        software=recording.get("software", ""),
        agent=recording.get("agent", ""),
        began_ns=began_ns or reader.span_ns[0],
        duration_s=reader.span_s,
        size_bytes=reader.size_bytes,
        messages=sum(tally.count for tally in tallies.values()),
        finished=bool(reader.about(layout.SUMMARY)),
        cut_bytes=reader.cut_bytes,
        gaps=sequences.gaps(),
        unknown=_unknown(reader),
        config=recorded_config(reader),
        topics=rows,
    )


def _time_ns(text: str) -> int:
    """A recorded time; 0 where it is none, as metadata have no checksum."""
    return int(text) if text.isdecimal() else 0


def _tallies(
    reader: LogReader, sequences: SequenceTracker, progress: Progress | None
) -> dict[str, _Tally]:
    """The messages of each topic that the log has a channel for; follows their numbers too."""
    tallies: dict[str, _Tally] = {}
    for channel in reader.channels.values():
        if channel.topic in BY_NAME:
            tallies[channel.topic] = _Tally()

    for record in reader.records(progress=progress):
        name = record.topic_name
        tally = tallies.setdefault(name, _Tally())
        tally.add(record)
        envelope = record.envelope
        if envelope is not None:
            sequences.follow(record.topic, envelope)
    return tallies


def _unknown(reader: LogReader) -> list[str]:
    channels = reader.channels.values()
    names = {channel.topic for channel in channels}
    known = {*BY_NAME, layout.ENVELOPES}
    return sorted(names - known)


def _topic(name: str, tally: _Tally, duration_s: float, lost: int) -> TopicInfo:
    topic = BY_NAME[name]
    return TopicInfo(
        topic=name,
        type=topic.type.__name__,
        delivery=topic.delivery.value,
        count=tally.count,
        rate_hz=tally.count / duration_s if duration_s > 0 else 0.0,
        mean_bytes=tally.size / tally.count if tally.count else 0.0,
        lost=lost,
        sources=dict(sorted(tally.sources.items())),
    )
