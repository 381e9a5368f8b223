"""A copy of the workspace's graph that follows its deltas."""

from __future__ import annotations

from collections.abc import Callable

from cogmap.bus.codec import decode, encode
from cogmap.bus.interface import Bus
from cogmap.errors import CogmapError, NoAnswerError
from cogmap.graph.graph import Graph
from schemas import topics
from schemas.graph import Delta, Snapshot, SnapshotRequest

SNAPSHOT_TIMEOUT_S = 2.0


class Replica:
    """Applies deltas in order. A gap is mended by a snapshot, which `fetch` asks for; until then
    the graph stays.
    """

    def __init__(
        self, fetch: Callable[[SnapshotRequest], Snapshot], graph: Graph | None = None
    ) -> None:
        self.graph = graph or Graph()
        self.mended = 0
        self._fetch = fetch

    def follow(self, delta: Delta) -> bool:
        """Take in `delta`. False while the graph is behind it: no snapshot could be had yet."""
        if delta.version > self.graph.version + 1:
            try:
                snapshot = self._fetch(SnapshotRequest(at_least=delta.version - 1))
            except NoAnswerError:
                return False
            if snapshot.version > self.graph.version:
                self.graph.load(snapshot)
                self.mended += 1
        return self.graph.apply(delta) or self.graph.version >= delta.version


def snapshot_over(
    bus: Bus, timeout_s: float = SNAPSHOT_TIMEOUT_S
) -> Callable[[SnapshotRequest], Snapshot]:
    """Asks the workspace on `bus` for its graph. Raises NoAnswerError."""

    def fetch(request: SnapshotRequest) -> Snapshot:
        answer = bus.query(topics.SNAPSHOT_REQUEST, encode(request), timeout_s)
        snapshot = decode(topics.SNAPSHOT, answer)
        if not isinstance(snapshot, Snapshot):
            raise CogmapError(f"{topics.SNAPSHOT.name} carries {type(snapshot).__name__}")
        return snapshot

    return fetch
