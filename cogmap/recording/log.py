"""Reads a log from Python: typed messages by topic and time, and the graph as it was at a time."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from cogmap.bus.codec import Envelope, decode
from cogmap.errors import LogError, MessageError
from cogmap.evaluation.paths import FOLLOWED
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.recording import path_errors, selection, table
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.format import MAX_TIME_NS
from cogmap.recording.storage.reader import LogReader, Record
from cogmap.schemas import topics as topic_table
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import PathColumn
from cogmap.schemas.topics import Topic

if TYPE_CHECKING:
    import pyarrow

BISECTED_S = 0.5
"""A span of a log that is read as it is, not bisected any more: about a chunk."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A message in a log.

    `time_s` is when it was received, in seconds since the log's first message; `log_time_ns` the
    same on the recorder's wall clock. `envelope` is None if the log holds none.
    """

    topic: str
    message: Message
    time_s: float
    log_time_ns: int
    envelope: Envelope | None


class Log:
    """A recorded log. Made by `open_log`; reads the file as messages are asked for, and frees the
    memory of what it read at the end of a `with` statement.
    """

    def __init__(self, reader: LogReader) -> None:
        self._reader = reader
        self._start_ns = reader.span_ns[0]

    def __enter__(self) -> Log:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._reader.forget()

    @property
    def path(self) -> Path:
        """Return the path of the file."""
        return self._reader.path

    @property
    def duration_s(self) -> float:
        """Return the seconds from the first message to the last."""
        return self._reader.span_s

    @property
    def software(self) -> str:
        """Return the program that recorded it, such as `cogmap 0.2.0`."""
        return self._about().get("software", "")

    @property
    def agent(self) -> str:
        """Return the agent whose topics these are."""
        return self._about().get("agent", "")

    @property
    def config(self) -> dict[str, dict[str, Any]]:
        """Return the configuration of the recording, by module and key. Raises LogError."""
        return recorded_config(self._reader)

    @property
    def topics(self) -> list[str]:
        """Return the topics that it has a channel for, in the table's order; some may be empty."""
        channels = self._reader.channels.values()
        recorded = {channel.topic for channel in channels}

        names = [topic.name for topic in topic_table.ALL]
        return [name for name in names if name in recorded]

    def messages(
        self, *topics: str | Topic, start_s: float = 0.0, end_s: float | None = None
    ) -> Iterator[Entry]:
        """Yield messages on `topics`, on all if none is named, in the order in which they were
        received. A topic is named, or is one of the table: `"odometry"`, `topics.ODOMETRY`.

        Those from `start_s` (inclusive) to `end_s` (exclusive) into the log. Raises UsageError for
        an unknown topic; LogError if the log is damaged or a message does not fit its topic.
        """
        chosen = selection.named(topics) or None
        for record in self._between(chosen, start_s, end_s):
            yield Entry(
                topic=record.topic_name,
                message=self._message(record),
                time_s=(record.log_time_ns - self._start_ns) / 1e9,
                log_time_ns=record.log_time_ns,
                envelope=record.envelope,
            )

    def frame(
        self, topic: str | Topic, *, start_s: float = 0.0, end_s: float | None = None
    ) -> pyarrow.Table:
        """Return the messages on `topic` as an Arrow table: a row a message, a column a field.

        `time_s` is when each was received; the fields of a part are columns of their own, such as
        `pose.x_m`. Its `to_pandas()` is pandas', `polars.from_arrow` makes it polars'. Those from
        `start_s` (inclusive) to `end_s` (exclusive). Raises as `messages` does, and UsageError if
        there is no pyarrow.
        """
        chosen = selection.named([topic])
        ((_, only),) = self.frames(chosen, start_s=start_s, end_s=end_s)
        return only

    def frames(
        self, topics: Collection[Topic], *, start_s: float = 0.0, end_s: float | None = None
    ) -> Iterator[tuple[Topic, pyarrow.Table]]:
        """Yield each of `topics` with its table, as `frame` gives it; the log is read once for all.

        Raises as `frame` does.
        """
        first_ns, end_ns = self._span_ns(start_s, end_s)
        payloads = self._reader.payloads(topics, start_ns=first_ns, end_ns=end_ns)
        for topic, found in payloads.items():
            yield topic, table.table(topic.type, self._rows(topic, found))

    def _rows(
        self, topic: Topic, payloads: list[tuple[int, bytes]]
    ) -> Iterator[tuple[float, Message]]:
        for log_time_ns, payload in payloads:
            yield (log_time_ns - self._start_ns) / 1e9, self._decoded(topic, payload)

    def path_frame(self, time_s: float | None = None) -> pyarrow.Table:
        """Return the agent's path as it believed it at `time_s` into the log, at its end if that is
        not given: a row a place, a column for each PathColumn, such as `x_m`.

        Raises as `graph_at` does, and UsageError if there is no pyarrow.
        """
        arrow = table.arrow_library()
        graph = self.graph_at(self.duration_s if time_s is None else time_s)
        rows = rows_of(graph.path)
        return arrow.table({column.name.lower(): rows[:, column] for column in PathColumn})

    def errors(self) -> pyarrow.Table:
        """Return how far the agent was from where it believed to be: a row a moment of which there
        is an estimate and the truth.

        `time_s` is when the estimate was received first, `stamp_ns` of when it is; `x_m`, `y_m` and
        `heading_rad` are the true pose. The errors of position, in metres, and of heading, in
        radians, are those of the estimate (`estimate_m`, `estimate_rad`) and of path integration
        alone: of fused self-motion (`fused_m`, `fused_rad`) and, where they publish odometry, of
        the wheels (`wheels_m`, `wheels_rad`). A summary of the drive has the same.

        Raises as `messages` does, UsageError if there is no pyarrow, and LogError if nobody knows
        the truth, or the log was begun in the middle of a drive.
        """
        entries = self.messages(*FOLLOWED)
        return path_errors.table(self.path, ((entry.time_s, entry.message) for entry in entries))

    def last(self, topic: str | Topic, holds: Callable[[Any], bool]) -> Entry | None:
        """Return the last message on `topic` for which `holds` is true; None if it is for none.

        If `holds` is true for a message, it must be for all before, as "of cycle 9 or before" is.
        Bisection finds it: little of a long log is read. Raises as `messages` does.
        """
        found = None
        begin_s = 0.0
        end_s = self.duration_s + BISECTED_S
        while end_s - begin_s > BISECTED_S:
            middle_s = (begin_s + end_s) / 2
            entry = next(self.messages(topic, start_s=middle_s, end_s=end_s), None)
            if entry is not None and holds(entry.message):
                found = entry
                begin_s = entry.time_s
            else:
                end_s = middle_s

        for entry in self.messages(topic, start_s=begin_s, end_s=end_s):
            if not holds(entry.message):
                break
            found = entry
        return found

    def graph_at(self, time_s: float) -> Graph:
        """Return the workspace's graph after every delta received up to `time_s` into the log.

        Raises LogError if the log lacks a delta before that, as one does that was begun in the
        middle of a drive.
        """
        graph = Graph()
        for record in self._between([topic_table.DELTA], 0.0, None):
            if record.log_time_ns - self._start_ns > time_s * 1e9:
                break
            delta = self._message(record)
            assert isinstance(delta, Delta)
            if not graph.apply(delta) and delta.version > graph.version:
                raise LogError(
                    f"{self.path} holds delta {delta.version} after delta {graph.version}, not "
                    "every one between: no graph can be had of it, record a whole drive"
                )
        return graph

    def _between(
        self, chosen: Collection[Topic] | None, start_s: float, end_s: float | None
    ) -> Iterator[Record]:
        first_ns, end_ns = self._span_ns(start_s, end_s)
        return self._reader.records(chosen, start_ns=first_ns, end_ns=end_ns)

    def _span_ns(self, start_s: float, end_s: float | None) -> tuple[int, int]:
        """Return the log times between which, in seconds into the log, something is asked for."""
        end_ns = MAX_TIME_NS
        if end_s is not None:
            end_ns = self._start_ns + round(end_s * 1e9)
        return self._start_ns + round(start_s * 1e9), end_ns

    def _message(self, record: Record) -> Message:
        return self._decoded(record.topic, self._reader.payload(record))

    def _decoded(self, topic: Topic, payload: bytes) -> Message:
        try:
            return decode(topic, payload)
        except MessageError as error:
            raise LogError(f"{self.path}: a message cannot be read: {error}") from None

    def _about(self) -> dict[str, str]:
        return self._reader.about(layout.RECORDING)


def open_log(path: Path | str) -> Log:
    """Open the log at `path`, or in the run's folder at `path`, for reading.

    Raises LogError if there is none, or it is foreign, damaged or of a version that is not read.

        with open_log("runs/latest") as log:
            for entry in log.messages("odometry", start_s=2.0, end_s=4.0):
                print(entry.time_s, entry.message.speed_m_s)
            print(log.frame("truth/pose").to_pandas())
            print(log.path_frame().to_pandas())
            print(log.errors().to_pandas())
            print(len(log.graph_at(4.0).nodes))
    """
    return Log(LogReader(Path(path)))


def recorded_config(reader: LogReader) -> dict[str, dict[str, Any]]:
    """Return the configuration that a log was recorded with. Raises LogError if it cannot be
    read.
    """
    try:
        sections = json.loads(reader.about(layout.RECORDING).get("config", "{}"))
    except (ValueError, RecursionError) as error:
        raise LogError(
            f"{reader.path} holds a configuration that cannot be read: {error}"
        ) from None
    if not isinstance(sections, dict):
        raise LogError(f"{reader.path} holds a configuration without sections")
    return sections
