"""Whether time stands because somebody asked for it: of a simulation, or of a recording. Pure."""

from __future__ import annotations

from cogmap.schemas.process import Pause, Paused

SAID_PERIOD_NS = 1_000_000_000
"""Wall time after which it is said again that time stands, for those who join later."""


class Pausing:
    """Follows what is asked for. While time stands, `steps` more views are still to come."""

    def __init__(self) -> None:
        self.is_paused = False
        self.steps = 0
        self._said_ns = 0

    def on_pause(self, pause: Pause) -> None:
        """Let time stand after so many more views, or pass."""
        self.is_paused = pause.is_paused
        self.steps = pause.views if pause.is_paused else 0

    def takes_step(self) -> bool:
        """Decide whether the next view may come now. While time stands, that is one view less to
        come.
        """
        if not self.is_paused:
            return True
        if not self.steps:
            return False

        self.steps -= 1
        return True

    def said(self, stamp_ns: int) -> Paused:
        """Return whether time stands, at `stamp_ns` of it."""
        return Paused(stamp_ns=stamp_ns, is_paused=self.is_paused)

    def said_again(self, stamp_ns: int, wall_ns: int) -> list[Paused]:
        """Return that time stands, if it does and has not been said for SAID_PERIOD_NS."""
        if not self.is_paused or wall_ns - self._said_ns < SAID_PERIOD_NS:
            return []

        self._said_ns = wall_ns
        return [self.said(stamp_ns)]
