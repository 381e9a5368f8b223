"""Compares two logs message by message: what was said, never how it travelled."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator
from pathlib import Path

import msgspec

from cogmap.recording.replaying import compare
from cogmap.recording.storage.reader import LogReader, Progress, Record
from schemas import topics
from schemas.topics import About, Topic

Key = tuple[str, str, int, int]


class TopicDiff(msgspec.Struct, kw_only=True):
    """How a topic compares: messages in each log, the `same` in both, those that differ or are in
    one only.

    `first` is the first difference in words, empty where there is none.
    """

    topic: str
    left: int = 0
    right: int = 0
    same: int = 0
    different: int = 0
    left_only: int = 0
    right_only: int = 0
    first: str = ""


class Diff(msgspec.Struct, kw_only=True):
    """How two logs compare; `first` is the first difference in the left one's order."""

    left: str
    right: str
    same: bool
    first: str
    topics: list[TopicDiff]


def model_topics() -> list[Topic]:
    """The topics whose bytes are the same for the same seed."""
    return [topic for topic in topics.ALL if topic.about is About.MODEL]


def diff(
    left: Path,
    right: Path,
    chosen: Collection[Topic] | None = None,
    progress: Progress | None = None,
) -> Diff:
    """Compare the messages on `chosen`, every MODEL topic where it is None, by source, incarnation
    and number.

    Raises LogError where one is no log, or damaged.
    """
    return _Comparison(
        LogReader(left), LogReader(right), model_topics() if chosen is None else chosen
    ).run(progress)


class _Comparison:
    """Both logs and what has been found so far."""

    def __init__(self, left: LogReader, right: LogReader, chosen: Collection[Topic]) -> None:
        self._left = left
        self._right = right
        self._chosen = chosen
        self._found: dict[str, TopicDiff] = {}
        self._first = ""
        self._sides = (str(left.path), str(right.path))
        if left.path.name != right.path.name:
            self._sides = (left.path.name, right.path.name)

    def run(self, progress: Progress | None) -> Diff:
        others = dict(_keyed(self._right, self._chosen, None))
        for record in others.values():
            self._of(record).right += 1
        for key, record in _keyed(self._left, self._chosen, progress):
            self._of(record).left += 1
            self._hold(record, others.pop(key, None))
        for record in others.values():
            self._of(record).right_only += 1
            self._differ(record, self._only(self._right, record, 1))
        return Diff(
            left=str(self._left.path),
            right=str(self._right.path),
            same=not self._first,
            first=self._first,
            topics=[self._found[topic.name] for topic in topics.ALL if topic.name in self._found],
        )

    def _hold(self, record: Record, other: Record | None) -> None:
        found = self._of(record)
        if other is None:
            found.left_only += 1
            self._differ(record, self._only(self._left, record, 0))
            return
        payload = self._left.payload(record)
        others = self._right.payload(other)
        if payload == others:
            found.same += 1
            return
        found.different += 1
        if not found.first:
            self._differ(record, compare.in_words(record.topic, payload, others, self._sides))

    def _only(self, reader: LogReader, record: Record, side: int) -> str:
        name = compare.which(record.topic, reader.stub(record))
        return f"{name} is in {self._sides[side]} and not in {self._sides[1 - side]}"

    def _differ(self, record: Record, sentence: str) -> None:
        found = self._of(record)
        found.first = found.first or sentence
        self._first = self._first or sentence

    def _of(self, record: Record) -> TopicDiff:
        return self._found.setdefault(record.topic_name, TopicDiff(topic=record.topic_name))


def _keyed(
    reader: LogReader, chosen: Collection[Topic], progress: Progress | None
) -> Iterator[tuple[Key, Record]]:
    """Each message by what it is called in either log: incarnations are counted, as their times
    differ.
    """
    lives: dict[str, dict[int, int]] = defaultdict(dict)
    for record in reader.records(chosen, progress):
        envelope = record.envelope
        if envelope is None:
            stub = reader.stub(record)
            yield (record.topic_name, stub.source, 0, stub.seq), record
        else:
            known = lives[envelope.source]
            life = known.setdefault(envelope.incarnation, len(known))
            yield (record.topic_name, envelope.source, life, envelope.seq), record
