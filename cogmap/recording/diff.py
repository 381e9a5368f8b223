"""Compares two logs message by message: what messages hold, not how they travelled."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator
from pathlib import Path

import msgspec

from cogmap.recording.replaying import compare
from cogmap.recording.storage.reader import LogReader, Progress, Record
from cogmap.schemas import topics
from cogmap.schemas.topics import Scope, Topic

Key = tuple[str, str, int, int]


class TopicDiff(msgspec.Struct, kw_only=True):
    """How a topic compares: messages in each log, the `same` in both, those that differ or are in
    one only.

    `first` is the first difference in words, empty if there is none.
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
    """Return the topics whose bytes are the same for the same seed."""
    return [topic for topic in topics.ALL if topic.scope is Scope.MODEL]


def diff(
    left: Path,
    right: Path,
    chosen: Collection[Topic] | None = None,
    progress: Progress | None = None,
) -> Diff:
    """Compare the messages on `chosen`, every MODEL topic if it is None, by source, incarnation and
    number.

    Raises LogError if one is no log, or damaged.
    """
    if chosen is None:
        chosen = model_topics()
    return _Comparison(LogReader(left), LogReader(right), chosen).run(progress)


class _Comparison:
    """Two logs and what has been found of them so far."""

    def __init__(self, left: LogReader, right: LogReader, chosen: Collection[Topic]) -> None:
        self._left = left
        self._right = right
        self._chosen = chosen
        self._found: dict[str, TopicDiff] = {}
        self._first = ""
        # Sentences call the logs by their files' names or, if these are equal, by their paths.
        self._sides = left.path.name, right.path.name
        if left.path.name == right.path.name:
            self._sides = str(left.path), str(right.path)

    def run(self, progress: Progress | None) -> Diff:
        """Compare every message of either log."""
        unmatched = dict(_keyed(self._right, self._chosen, None))
        for record in unmatched.values():
            self._of(record).right += 1

        for key, record in _keyed(self._left, self._chosen, progress):
            found = self._of(record)
            found.left += 1
            other = unmatched.pop(key, None)
            if other is None:
                found.left_only += 1
                self._note(record, self._in_one_only(self._left, record, 0))
                continue

            payload = self._left.payload(record)
            counterpart = self._right.payload(other)
            if payload == counterpart:
                found.same += 1
                continue
            found.different += 1
            if not found.first:
                sentence = compare.describe(record.topic, payload, counterpart, self._sides)
                self._note(record, sentence)

        for record in unmatched.values():
            self._of(record).right_only += 1
            self._note(record, self._in_one_only(self._right, record, 1))

        names = [topic.name for topic in topics.ALL if topic.name in self._found]
        return Diff(
            left=str(self._left.path),
            right=str(self._right.path),
            same=not self._first,
            first=self._first,
            topics=[self._found[name] for name in names],
        )

    def _in_one_only(self, reader: LogReader, record: Record, side: int) -> str:
        name = compare.title(record.topic, reader.stub(record))
        here = self._sides[side]
        there = self._sides[1 - side]
        return f"{name} is in {here} and not in {there}"

    def _note(self, record: Record, sentence: str) -> None:
        """Keep the sentence on a difference, if it is the first."""
        found = self._of(record)
        found.first = found.first or sentence
        self._first = self._first or sentence

    def _of(self, record: Record) -> TopicDiff:
        name = record.topic_name
        if name not in self._found:
            self._found[name] = TopicDiff(topic=name)
        return self._found[name]


def _keyed(
    reader: LogReader, chosen: Collection[Topic], progress: Progress | None
) -> Iterator[tuple[Key, Record]]:
    """Yield each message with what names it in either log.

    A source's incarnations are counted, as the times that they are known by differ.
    """
    incarnations: dict[str, dict[int, int]] = defaultdict(dict)
    for record in reader.records(chosen, progress):
        envelope = record.envelope
        if envelope is None:
            stub = reader.stub(record)
            key = record.topic_name, stub.source, 0, stub.seq
            yield key, record
            continue

        known = incarnations[envelope.source]
        number = known.setdefault(envelope.incarnation, len(known))
        key = record.topic_name, envelope.source, number, envelope.seq
        yield key, record
