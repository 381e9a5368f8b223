"""The robot driven by the keys of a page, in the place of the module `motor`."""

from __future__ import annotations

import threading
from contextlib import suppress

from cogmap.cli.teleop import DIRECTIONS, ENDS, Steering, check_nobody_drives
from cogmap.errors import CogmapError, UsageError
from cogmap.runtime.client import Client


class Driving:
    """Drives the robot of the system at `endpoint` from the first key until it is left. Any thread
    may call it: a key that is pressed while the first one takes the wheel waits for that.
    """

    def __init__(self, endpoint: str, agent: str) -> None:
        self._endpoint = endpoint
        self._agent = agent
        self._steering = Steering()
        self._client: Client | None = None
        self._lock = threading.Lock()

    def press(self, key: str) -> str:
        """Go where `key` leads, as one of `cogmap teleop` does. Returns a sentence on what was
        done. Raises UsageError if another process drives, or for another key, and what has ended
        the driving, until it is left.
        """
        if key in ENDS:
            self.leave()
            return "the robot is left alone"
        if key not in DIRECTIONS:
            raise UsageError(f"the key {key!r} leads nowhere: u i o j k l m , . and arrows drive")

        with self._lock:
            if self._client is None:
                check_nobody_drives(self._endpoint, self._agent)
                self._steering = Steering()
                client = Client(self._steering.module(), self._endpoint, self._agent)
                client.__enter__()
                self._client = client
            self._client.check()
            self._steering.press(key)
        return "you drive"

    def leave(self) -> None:
        """Drive no longer."""
        with self._lock:
            client = self._client
            self._client = None
            if client is not None:
                with suppress(CogmapError):  # the system has ended
                    client.__exit__(None, None, None)
