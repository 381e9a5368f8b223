"""Which percepts come too late to begin a cycle. Pure."""

from __future__ import annotations


class ViewOrder:
    """Compares each view with that of the last cycle.

    One older view is late. Two in succession show that time has gone back, as where a simulation
    begins anew, or where the views before them had stamps that were not true.
    """

    def __init__(self) -> None:
        self._was_older = False
        self._late = 0

    def is_late(self, stamp_ns: int, cycle_ns: int) -> bool:
        """Decide whether a view is ignored. `cycle_ns` is the stamp of the last cycle's view."""
        was_older = self._was_older
        self._was_older = stamp_ns < cycle_ns
        if not self._was_older or was_older:
            return False

        self._late += 1
        return True

    def notes(self) -> list[str]:
        """Return how many views were late, in words."""
        if not self._late:
            return []
        return [f"{self._late} times percepts were older than those before them"]
