"""What is in a log: how long, how big, how much of what, and whether it is whole."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from cogmap.recording.storage import format as layout
from cogmap.recording.storage.reader import LogReader, Progress
from cogmap.recording.storage.sequences import SequenceTracker
from schemas.topics import BY_NAME


class TopicInfo(msgspec.Struct, kw_only=True):
    """One topic: its messages by source, their rate over the log's duration, and how many numbers
    lack.
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
    """A log. `cut_bytes` at its end cannot be read; `finished` says that its recorder ended it.

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
    count: int = 0
    size: int = 0
    sources: dict[str, int] = field(default_factory=dict)


def info(path: Path, progress: Progress | None = None) -> Info:
    """What is in the log at `path`. Raises LogError."""
    reader = LogReader(path)
    about = reader.about(layout.RECORDING)
    began_ns = int(about.get("began_ns", "0"))
    sequences = SequenceTracker(since_ns=began_ns or None)
    names = [channel.topic for channel in reader.channels.values()]
    tallies = {name: _Tally() for name in names if name in BY_NAME}
    for record in reader.records(progress=progress):
        tally = tallies.setdefault(record.topic_name, _Tally())
        tally.count += 1
        tally.size += record.size
        source = "?" if record.envelope is None else record.envelope.source
        tally.sources[source] = tally.sources.get(source, 0) + 1
        if record.envelope is not None:
            sequences.follow(record.topic, record.envelope)
    lost = sequences.lost()
    return Info(
        path=str(path),
        software=about.get("software", ""),
        agent=about.get("agent", ""),
        began_ns=began_ns or reader.span_ns[0],
        duration_s=reader.span_s,
        size_bytes=reader.size_bytes,
        messages=sum(tally.count for tally in tallies.values()),
        finished=bool(reader.about(layout.SUMMARY)),
        cut_bytes=reader.cut_bytes,
        gaps=sequences.gaps(),
        unknown=sorted(name for name in names if name not in BY_NAME and name != layout.ENVELOPES),
        config=json.loads(about.get("config", "{}")),
        topics=[
            _topic(name, tally, reader.span_s, lost.get(name, 0)) for name, tally in tallies.items()
        ],
    )


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
