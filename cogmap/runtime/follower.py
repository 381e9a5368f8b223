"""Keeps the graph of a module that follows the workspace's deltas."""

from __future__ import annotations

import time
from collections.abc import Callable

from cogmap.bus.interface import Bus
from cogmap.errors import NoAnswerError
from cogmap.graph.graph import Graph
from cogmap.graph.replica import Fetched, Replica, snapshot_over
from cogmap.schemas.graph import Delta, SnapshotRequest

# Pause after a failure; an answer takes long if the workspace is busy and the graph large.
RETRY_S = 0.5
TIMEOUT_S = 20.0


class Follower:
    """A replica whose snapshots come over `bus`, at most one query that fails in RETRY_S.

    `on_load` is called with each snapshot that replaced the graph.
    """

    def __init__(self, graph: Graph, bus: Bus, on_load: Callable[[Fetched], None]) -> None:
        self._ask = snapshot_over(bus, TIMEOUT_S)
        self._not_before_s = 0.0
        self._replica = Replica(self._fetch, graph, on_load)

    def join(self) -> None:
        """Load the graph as it is now, empty if no workspace answers."""
        self._replica.join()

    def follow(self, delta: Delta, incarnation: int) -> bool:
        """Apply `delta`. Returns true if the graph holds it."""
        return self._replica.follow(delta, incarnation)

    def retry(self) -> None:
        """Mend the graph, if it is behind, or join, if no workspace has answered yet."""
        if self._replica.is_behind:
            self._replica.mend()
        elif not self._replica.has_joined:
            self._replica.join()

    def notes(self) -> list[str]:
        """Return what there is to report: whether it is behind, and how often it was mended."""
        replica = self._replica
        notes = []
        if replica.is_behind:
            notes.append(
                f"the graph stays at version {replica.graph.version}: "
                f"deltas are missing and no snapshot is to be had from the workspace"
            )
        if replica.mended:
            notes.append(f"snapshots that replaced the graph after a gap: {replica.mended}")
        return notes

    def _fetch(self, request: SnapshotRequest) -> Fetched:
        if time.monotonic() < self._not_before_s:
            raise NoAnswerError("the last query has just failed")
        try:
            return self._ask(request)
        except NoAnswerError:
            self._not_before_s = time.monotonic() + RETRY_S
            raise
