"""Keeps the graph of a module that follows the workspace's deltas."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

from cogmap.bus.interface import Bus
from cogmap.errors import MessageError, NoAnswerError
from cogmap.graph.graph import Graph
from cogmap.graph.replica import Fetched, Replica, snapshot_over
from cogmap.schemas.graph import Delta, SnapshotRequest

log = logging.getLogger("cogmap")
# Pause after a failure; an answer takes long if the workspace is busy and the graph large.
RETRY_S = 0.5
TIMEOUT_S = 20.0


class Follower:
    """A replica whose snapshots come over `bus`, at most one query in RETRY_S that fails or was
    asked for by what is not true.

    `on_load` is called with each snapshot that replaced the graph.
    """

    def __init__(self, graph: Graph, bus: Bus, on_load: Callable[[Fetched], None]) -> None:
        self._ask = snapshot_over(bus, TIMEOUT_S)
        self._not_before_s = 0.0
        self._strange = 0
        self._is_replaced = False
        self._replica = Replica(self._fetch, graph, on_load)

    def join(self) -> None:
        """Load the graph as it is now, empty if no workspace answers."""
        self._replica.join()

    def follow(self, delta: Delta, incarnation: int) -> bool:
        """Apply `delta`. Returns true if the graph holds it. Raises MessageError if it is of
        another source than the graph.
        """
        replica = self._replica
        if replica.is_strange(delta):
            self._strange += 1
            self._is_replaced = True
            raise MessageError(
                f"workspace/delta: {delta.source} is not {replica.source}, whose graph this is"
            )

        untrue = replica.untrue + replica.forks
        is_held = replica.follow(delta, incarnation)
        if replica.untrue + replica.forks > untrue:
            self._not_before_s = time.monotonic() + RETRY_S
            log.warning("%s", self.notes()[-1])
        self._is_replaced = self._is_replaced and not is_held
        return is_held

    def retry(self) -> None:
        """Mend the graph, if it is behind, or join, if no workspace has answered yet, or if only
        another one has published since the last time.
        """
        if self._replica.is_behind:
            self._replica.mend()
        elif self._is_replaced or not self._replica.has_joined:
            self._is_replaced = not self._replica.join() and self._is_replaced

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
        if self._strange:
            notes.append(f"{self._strange} deltas came of another source than {replica.source}")
        if replica.untrue:
            notes.append(
                f"{replica.untrue} deltas had versions that the workspace has not committed: "
                f"somebody else publishes in its name"
            )
        if replica.forks:
            notes.append(
                f"the graph was a fork of the workspace's {replica.forks} times, until a snapshot "
                f"replaced it: somebody else publishes deltas in its name"
            )
        return notes

    def _fetch(self, request: SnapshotRequest) -> Fetched:
        if time.monotonic() < self._not_before_s:
            raise NoAnswerError("the last query has just failed")
        try:
            return self._ask(request)
        except NoAnswerError:
            self._not_before_s = time.monotonic() + RETRY_S
            raise
