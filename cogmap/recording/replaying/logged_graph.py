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
        """Return the last graph at `version` that was committed before a time.

        Raises LogError if the log does not hold every delta up to it.
        """
        if self._commits is None:
            self._commits = []
            for record in self._reader.records({topics.DELTA}):
                delta = self._reader.message(record)
                assert isinstance(delta, Delta)
                envelope = record.envelope
                sent_ns = record.log_time_ns if envelope is None else envelope.sent_ns
                self._commits.append(_Commit(delta, sent_ns))

        positions = (
            position
            for position, commit in reversed(list(enumerate(self._commits, start=1)))
            if commit.delta.version == version and commit.sent_ns <= before_ns
        )
        position = next(positions, 0)
        if position < self._position:
            self._graph = Graph()
            self._position = 0

        # After a gap the graph is not known, until a workspace begins anew.
        for commit in self._commits[self._position : position]:
            if commit.delta.version == 1:
                self._graph = Graph()
            self._graph.apply(commit.delta)

        self._position = position
        if not position or self._graph.version != version:
            raise LogError(
                f"{self._reader.path}: a module loaded the graph at version {version}, and the log "
                f"does not hold every delta up to it: record from the start of the workspace"
            )
        return self._graph.snapshot()
