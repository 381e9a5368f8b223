"""Copies a part of a log into another, and several into one."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
from mcap.writer import CompressionType

from cogmap.errors import UsageError
from cogmap.recording.recorder import Summary
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.format import MAX_TIME_NS
from cogmap.recording.storage.reader import LogReader, Progress, Record
from cogmap.recording.storage.sequences import SequenceTracker
from cogmap.recording.storage.writer import LogWriter
from cogmap.runtime.state.new_file import new_file
from cogmap.schemas.topics import ALL, BY_NAME, Delivery, Topic

SHARED_FACTS = ("software", "agent")
"""What logs must have in common to become one."""

Found = tuple[LogReader, Record]


class Copied(msgspec.Struct, kw_only=True):
    """What was copied, by topic. `twice` messages were in several logs, and are there once;
    `unknown` are topics that are in no table, and were left out.
    """

    path: str
    size_bytes: int
    duration_s: float
    messages: dict[str, int]
    twice: int
    unknown: list[str]


@dataclass(frozen=True, kw_only=True)
class Part:
    """The part of logs that is meant: the messages on `topics`, from `start_s` (inclusive) to
    `end_s` (exclusive), in seconds since the first message of all.
    """

    topics: Collection[Topic]
    start_s: float = 0.0
    end_s: float | None = None


def copy(
    sources: Sequence[Path],
    target: Path,
    part: Part,
    *,
    compression: CompressionType = CompressionType.LZ4,
    progress: Progress | None = None,
) -> Copied:
    """Write a part of the logs `sources` into the new log `target`, in order of log time.

    It has the configuration of the one that begins first. Raises LogError if one cannot be read,
    UsageError if they are of different agents or versions or the part is empty, and StorageError if
    `target` exists or cannot be written.
    """
    readers = sorted(map(LogReader, sources), key=lambda reader: reader.span_ns)
    about = _about(readers)
    recorded = {channel.topic for reader in readers for channel in reader.channels.values()}
    wanted = [topic for topic in ALL if topic in part.topics and topic.name in recorded]

    with new_file(target) as made:
        writer = LogWriter(made, wanted, about, compression)
        _note_members(readers, writer)
        copying = _Copying(writer)
        copying.run(_found(readers, wanted, part, progress))
        if not copying.messages:
            raise UsageError(
                f"{sources[0]} holds no message of these topics and times: "
                f"`cogmap log info {sources[0]}` shows what it holds"
            )
        copying.finish(target)

    return Copied(
        path=str(target),
        size_bytes=target.stat().st_size,
        duration_s=copying.duration_s,
        messages=dict(copying.messages),
        twice=copying.twice,
        unknown=sorted(recorded - BY_NAME.keys() - {layout.ENVELOPES}),
    )


class _Copying:
    """Writes messages with `writer`, each once."""

    def __init__(self, writer: LogWriter) -> None:
        self.messages: Counter[str] = Counter()
        self.twice = 0
        self._writer = writer
        self._sequences = SequenceTracker()
        self._seen: set[tuple[str, str, int, int]] = set()
        self._span_ns: tuple[int, int] | None = None

    @property
    def duration_s(self) -> float:
        """Return the seconds from the first message to the last."""
        first_ns, last_ns = self._span_ns or (0, 0)
        return (last_ns - first_ns) / 1e9

    def run(self, found: Iterable[Found]) -> None:
        """Write these messages."""
        for reader, record in found:
            envelope = record.envelope
            if envelope is not None:
                source = envelope.source, envelope.incarnation, envelope.seq
                identity = record.topic_name, *source
                if identity in self._seen:
                    self.twice += 1
                    continue
                self._seen.add(identity)
                self._sequences.follow(record.topic, envelope)

            payload = reader.payload(record)
            self._writer.write(record.topic, payload, envelope, record.log_time_ns)
            self.messages[record.topic_name] += 1
            first_ns, _ = self._span_ns or (record.log_time_ns, 0)
            self._span_ns = first_ns, record.log_time_ns

    def finish(self, path: Path) -> None:
        """End the log that is to be at `path`, with what misses in it."""
        lost = self._sequences.lost()
        never_drop = [name for name in lost if BY_NAME[name].delivery is Delivery.NEVER_DROP]
        summary = Summary(
            path=str(path),
            duration_s=self.duration_s,
            size_bytes=0,
            messages=dict(self.messages),
            lost=lost,
            unrecovered={},
            dropped={},
            rejected={},
            gaps=self._sequences.gaps(),
            never_drop_whole=not never_drop,
        )
        self._writer.note(layout.SUMMARY, {"json": msgspec.json.encode(summary).decode()})
        self._writer.close()


def _found(
    readers: Sequence[LogReader],
    wanted: Collection[Topic],
    part: Part,
    progress: Progress | None,
) -> Iterator[Found]:
    """Yield the messages of the part, in order of log time."""
    begin_ns = min(reader.span_ns[0] for reader in readers)
    end_ns = max(reader.span_ns[1] for reader in readers)
    start_ns = begin_ns + round(part.start_s * 1e9)
    stop_ns = MAX_TIME_NS if part.end_s is None else begin_ns + round(part.end_s * 1e9)
    length_ns = max(1, min(end_ns, stop_ns) - start_ns)

    def of(reader: LogReader) -> Iterator[Found]:
        for record in reader.records(wanted, start_ns=start_ns, end_ns=stop_ns):
            yield reader, record

    for reader, record in heapq.merge(*map(of, readers), key=lambda found: found[1].log_time_ns):
        yield reader, record
        if progress is not None:
            progress((record.log_time_ns - start_ns) / length_ns)


def _about(readers: Sequence[LogReader]) -> dict[str, str]:
    """Return the facts of the first log. Raises UsageError where the others' differ."""
    first, *others = readers
    about = first.about(layout.RECORDING)
    for other in others:
        facts = other.about(layout.RECORDING)
        for name in SHARED_FACTS:
            if facts.get(name) != about.get(name):
                raise UsageError(
                    f"{first.path} is of {name} {about.get(name)!r}, and {other.path} of "
                    f"{facts.get(name)!r}: merge logs of one {name}"
                )
    return about


def _note_members(readers: Sequence[LogReader], writer: LogWriter) -> None:
    """Copy who came and went, and what else is noted in the logs but is not of their ends."""
    for reader in readers:
        for name, facts in reader.metadata:
            if name not in (layout.RECORDING, layout.SUMMARY):
                writer.note(name, facts)
