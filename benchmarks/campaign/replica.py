"""A module that follows the workspace's graph as every other does, to be compared with it."""

from __future__ import annotations

import threading
import time

from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import NoAnswerError
from cogmap.graph.graph import Graph
from cogmap.graph.replica import snapshot_over
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas.graph import SnapshotRequest

IDLE_S = 0.02
ANSWER_S = 3.0
TRIES = 4


class FollowedGraph:
    """A graph that follows the deltas on a thread of its own, until it is compared."""

    def __init__(self, endpoint: str, agent: str) -> None:
        self.graph = Graph()
        self._asking = ZenohBus(endpoint, agent)
        self._fetch = snapshot_over(self._asking, ANSWER_S)
        self._shell = Shell(
            Module("follower").following(self.graph), ZenohBus(endpoint, agent), health=False
        )
        self._shell.open()
        self._is_ended = threading.Event()
        self._stops_at: int | None = None
        self._stands = threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    @property
    def notes(self) -> list[str]:
        """Return what it would report in its health."""
        return self._shell.notes

    def is_same(self) -> bool | None:
        """Compare it with the workspace's graph at one version. None if there is no answer, or
        it stays behind.
        """
        try:
            for _ in range(TRIES):
                self._hold(0)
                theirs = Graph()
                theirs.load(self._fetch(SnapshotRequest()).snapshot)
                if not self._hold(theirs.version):
                    return None
                if self.graph.version == theirs.version:
                    return theirs.digest() == self.graph.digest()
        except NoAnswerError:
            return None
        finally:
            self._stops_at = None
        return None

    def close(self) -> None:
        """Leave the bus."""
        self._is_ended.set()
        self._thread.join()
        self._shell.close()
        self._asking.close()

    def _hold(self, version: int) -> bool:
        """Let it follow until `version`, and stand there. Returns whether it came so far."""
        self._stands.clear()
        self._stops_at = version
        return self._stands.wait(ANSWER_S)

    def _work(self) -> None:
        while not self._is_ended.is_set():
            stops_at = self._stops_at
            if stops_at is not None and self.graph.version >= stops_at:
                self._stands.set()
                time.sleep(IDLE_S)
            else:
                self._shell.spin_once(IDLE_S)
