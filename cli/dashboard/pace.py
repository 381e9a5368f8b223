"""How often a page of a running system is told what is new: as the machine has time for it."""

from __future__ import annotations

import time

import psutil

LOOK_S = 1.0
LONGEST_REST_MS = 1000.0

IDLE_ENOUGH = 0.5
IDLE_LITTLE = 0.1
"""Shares of the machine's processors that are idle: with so little of it a page rests longest, with
enough not at all. Modules on the same machine are not to wait for a picture of themselves.
"""


class Pace:
    """Follows how busy the processors of this machine are."""

    def __init__(self) -> None:
        psutil.cpu_percent()  # its first answer means nothing
        self._looked_s = time.monotonic()
        self._idle = 1.0

    def rest_ms(self) -> float:
        """Return how long a page is to rest before it asks again."""
        now_s = time.monotonic()
        if now_s - self._looked_s >= LOOK_S:
            self._looked_s = now_s
            self._idle = 1.0 - psutil.cpu_percent() / 100.0
        return rest_ms(self._idle)


def rest_ms(idle: float) -> float:
    """Return how long a page is to rest where that share of the processors is idle. Pure."""
    lacking = (IDLE_ENOUGH - idle) / (IDLE_ENOUGH - IDLE_LITTLE)
    return LONGEST_REST_MS * min(max(lacking, 0.0), 1.0)
