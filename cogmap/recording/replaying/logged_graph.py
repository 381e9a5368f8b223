"""The workspace's graph at a version, made from the deltas in a log."""

from __future__ import annotations

from dataclasses import dataclass

from cogmap.errors import LogError
from cogmap.graph.graph import Graph
from cogmap.recording.storage.reader import LogReader
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta, Snapshot


@dataclass(frozen=True, slots=True)
class _Commit:
    delta: Delta
    sent_ns: int


class LoggedGraph:
    """The graph as the deltas in the log of `reader` made it. It reads them when first asked."""

    def __init__(self, reader: LogReader) -> None:
        self._reader = reader
        self._commits: list[_Commit] | None = None
        self._graph = Graph()
        self._position = 0

    def at(self, version: int, before_ns: int) -> Snapshot:
        """The last graph at `version` that was committed before a time.

        Raises LogError where the log does not hold every delta up to it.
        """
        if self._commits is None:
            self._commits = self._read()
        position = self._find(self._commits, version, before_ns)
        if position < self._position:
            self._graph = Graph()
            self._position = 0

        for commit in self._commits[self._position : position]:
            self._apply(commit.delta)
        self._position = position
        if self._graph.version != version:
            raise self._lacking(version)
        return self._graph.snapshot()

    def _read(self) -> list[_Commit]:
        commits = []
        for record in self._reader.records({topics.DELTA}):
            delta = self._reader.message(record)
            assert isinstance(delta, Delta)
            sent_ns = record.log_time_ns if record.envelope is None else record.envelope.sent_ns
            commits.append(_Commit(delta, sent_ns))
        return commits

    def _find(self, commits: list[_Commit], version: int, before_ns: int) -> int:
        """The number of deltas from the log's first to the one that committed `version`."""
        for index in range(len(commits) - 1, -1, -1):
            commit = commits[index]
            if commit.delta.version == version and commit.sent_ns <= before_ns:
                return index + 1
        raise self._lacking(version)

    def _apply(self, delta: Delta) -> None:
        """Apply a delta. After a gap the graph is not known, until a workspace begins anew."""
        if delta.version == 1:
            self._graph = Graph()
        self._graph.apply(delta)

    def _lacking(self, version: int) -> LogError:
        return LogError(
            f"{self._reader.path}: a module loaded the graph at version {version}, and the log "
            f"does not hold every delta up to it: record from the start of the workspace"
        )
