"""A copy of the workspace's graph that follows its deltas."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import msgspec

from cogmap.bus.codec import decode, encode
from cogmap.bus.interface import Bus
from cogmap.errors import MessageError, NoAnswerError
from cogmap.graph.graph import Graph
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta, Snapshot, SnapshotRequest

# For those that only watch; a module that follows the graph waits longer.
SNAPSHOT_TIMEOUT_S = 2.0
# Some cycles: what is published in the place of a delta comes soon after it.
REMEMBERED_DELTAS = 64


@dataclass(frozen=True, slots=True)
class Fetched:
    """A snapshot with the instance that answered and its incarnation, None if it gave none."""

    snapshot: Snapshot
    source: str = ""
    incarnation: int | None = None


Fetch = Callable[[SnapshotRequest], Fetched]


class Replica:
    """Applies deltas to `graph` in order of their version, those of the workspace's instance alone.

    Where a delta is missing, the workspace was restarted, or the graph is a fork of the
    workspace's, it stays at its version (`is_behind`) until `fetch` returns a snapshot: `mended`
    counts those, `forks` how many of them replaced a fork, and `untrue` how many showed that a
    version was announced that the workspace does not have. `on_load` is called with each snapshot
    that replaced the graph.
    """

    def __init__(
        self,
        fetch: Fetch,
        graph: Graph | None = None,
        on_load: Callable[[Fetched], None] | None = None,
    ) -> None:
        self.graph = Graph() if graph is None else graph
        self.mended = 0
        self.forks = 0
        self.untrue = 0
        self.is_behind = False
        self.has_joined = False
        self.source = ""

        self._fetch = fetch
        self._on_load = on_load
        self._incarnation: int | None = None
        self._ended: set[int] = set()
        self._wanted_version = 0
        self._applied: dict[int, Delta] = {}

    def join(self) -> bool:
        """Load the graph as it is now. Returns whether a workspace answers: if none does, the graph
        stays empty, so join again then, unless a delta has come since.
        """
        try:
            fetched = self._fetch(SnapshotRequest())
        except NoAnswerError:
            return False

        self.has_joined = True
        self.source = fetched.source
        self._incarnation = fetched.incarnation
        if fetched.snapshot.version > 0:
            self._load(fetched)
        return True

    def is_strange(self, delta: Delta) -> bool:
        """Decide whether a delta is of another source than the graph."""
        return bool(self.source) and delta.source != self.source

    def follow(self, delta: Delta, incarnation: int | None = None) -> bool:
        """Apply `delta`, published by that incarnation of the workspace.

        Returns true if the graph holds it: false if a snapshot is needed and none was to be had, or
        if the delta is of another source, or of an incarnation that has ended.
        """
        if incarnation in self._ended or self.is_strange(delta):
            return False

        if self._is_other(incarnation):
            self.is_behind = True
            self._wanted_version = 0
        elif delta.version > self.graph.version + 1:
            self.is_behind = True
            self._wanted_version = max(self._wanted_version, delta.version - 1)
        elif self._is_fork(delta):
            self.forks += 1
            self.is_behind = True

        if self.is_behind and not self.mend():
            return False
        if self._is_other(incarnation):
            # One that began before the graph's is ignored from now on.
            if incarnation is not None and incarnation < (self._incarnation or 0):
                self._ended.add(incarnation)
            return False

        self.source = delta.source
        self._incarnation = incarnation
        self.has_joined = True
        if self.graph.apply(delta):
            self._note(delta)
        return self.graph.version >= delta.version

    def mend(self) -> bool:
        """Load a snapshot. Returns whether there was one.

        The workspace answers after all that it has published: a snapshot that is older than a delta
        shows that the delta is not the workspace's.
        """
        try:
            fetched = self._fetch(SnapshotRequest())
        except NoAnswerError:
            return False

        if self._is_other(fetched.incarnation) and self._incarnation is not None:
            self._ended.add(self._incarnation)
        elif fetched.snapshot.version < self._wanted_version:
            self.untrue += 1
        self.source = fetched.source
        self._incarnation = fetched.incarnation
        self._load(fetched)
        self.mended += 1
        self.is_behind = False
        self._wanted_version = 0
        return True

    def _is_other(self, incarnation: int | None) -> bool:
        """Return true if it is known to be another incarnation than the graph's."""
        if incarnation is None or self._incarnation is None:
            return False
        return incarnation != self._incarnation

    def _is_fork(self, delta: Delta) -> bool:
        """Decide whether the workspace published another delta in the place of one that was
        applied: an unlike one of that version, or one of another lineage.
        """
        graph = self.graph
        if delta.version <= graph.version:
            return self._applied.get(delta.version, delta) != delta

        is_stated = graph.lineage is not None and delta.lineage is not msgspec.UNSET
        return is_stated and delta.lineage != graph.lineage

    def _note(self, delta: Delta) -> None:
        self._applied[delta.version] = delta
        if len(self._applied) > REMEMBERED_DELTAS:
            del self._applied[next(iter(self._applied))]

    def _load(self, fetched: Fetched) -> None:
        self._applied.clear()
        self.graph.load(fetched.snapshot)
        if self._on_load is not None:
            self._on_load(fetched)


def snapshot_over(bus: Bus, timeout_s: float = SNAPSHOT_TIMEOUT_S) -> Fetch:
    """Return a function that asks the workspace on `bus` for its graph.

    That function raises NoAnswerError if there is no answer, or one that is not a snapshot.
    """

    def fetch(request: SnapshotRequest) -> Fetched:
        answer = bus.query(topics.SNAPSHOT_REQUEST, encode(request), timeout_s)
        try:
            snapshot = decode(topics.SNAPSHOT, answer.payload)
        except MessageError as error:
            raise NoAnswerError(f"the answer is no snapshot: {error}") from error

        assert isinstance(snapshot, Snapshot)
        if answer.envelope is None:
            return Fetched(snapshot)
        return Fetched(snapshot, answer.envelope.source, answer.envelope.incarnation)

    return fetch
