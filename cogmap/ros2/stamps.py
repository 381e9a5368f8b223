"""The robot's stamps as times of the run, and back. Pure."""

from __future__ import annotations

from cogmap.data.bags.order import LATE_NS
from cogmap.errors import MessageError

LEAD_NS = 1_000_000_000
"""The time of the first that was sensed: late enough for what led to it to be after 0."""


class Stamps:
    """The run's clock: it is LEAD_NS at the first stamp, and follows the robot's clock from then
    on. Between what is sensed, it passes as the wall's does.
    """

    def __init__(self) -> None:
        self._offset_ns: int | None = None
        self._newest_ns = 0
        self._arrived_ns = 0
        self._now_ns = 0

    @property
    def has_begun(self) -> bool:
        """Return whether there was a stamp."""
        return self._offset_ns is not None

    def of(self, robot_ns: int, wall_ns: int) -> int:
        """Return the run's time of a stamp that arrived at `wall_ns`, which is monotonic. Raises
        MessageError if it goes back by more than LATE_NS.
        """
        if self._offset_ns is None:
            self._offset_ns = robot_ns - LEAD_NS

        stamp_ns = robot_ns - self._offset_ns
        behind_ns = self._newest_ns - stamp_ns
        if behind_ns > LATE_NS:
            raise MessageError(
                f"a stamp goes back by {behind_ns / 1e9:.1f} s: let one clock stamp everything; if "
                "the robot was started again, start `cogmap ros2` again"
            )
        if behind_ns < 0:
            self._newest_ns = stamp_ns
            self._arrived_ns = wall_ns
        return stamp_ns

    def on_robot(self, stamp_ns: int) -> int:
        """Return the robot's stamp of a time of the run."""
        return stamp_ns + (self._offset_ns or 0)

    def now_ns(self, wall_ns: int) -> int:
        """Return the run's time at `wall_ns`; it never goes back, and is 0 before a stamp came."""
        if self._offset_ns is None:
            return 0

        passed_ns = max(0, wall_ns - self._arrived_ns)
        self._now_ns = max(self._now_ns, self._newest_ns + passed_ns)
        return self._now_ns
