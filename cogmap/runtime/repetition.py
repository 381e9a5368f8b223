"""When what was sensed last is published again in lockstep, as nobody has answered it. Pure."""

from __future__ import annotations

from collections import deque
from statistics import median

from cogmap.schemas.process import Presence

CHECK_NS = 100_000_000
"""How often the wait for an answer is looked at."""

REPEAT_AFTER_NS = 10_000_000_000
"""Wall time without an answer after which it is repeated, though nobody was away and the usual wait
is not known: no cycle of a loaded machine takes as long.
"""

UNDOUBTED_AFTER_NS = 3_000_000_000
UNDOUBTED_TIMES_USUAL = 20
"""The same once the usual wait is known: so long, and so many times the usual wait. An answer may
be missing because somebody answered a task with nothing in a worker's name.
"""

DOUBTED_AFTER_NS = 500_000_000
"""The same while something may be lost: longer than a cycle takes on a machine that is fast enough
for real time.
"""

TIMES_USUAL = 3
"""On a slower machine, so many times the usual wait: who is only slow is not asked again."""

DOUBTED_VIEWS = 3
"""A module that comes back may lack what three cycles wait for: the one before, its own, the next.
"""

KEPT_WAITS = 16
"""Of so many waits the usual one is the median; before there were any, all are 0."""


class Repetition:
    """Follows one view at a time, known by its stamp, until it is answered.

    Where a module has come back that was away, messages may be lost: the next DOUBTED_VIEWS views
    are not waited for long.
    """

    def __init__(self) -> None:
        self._away: set[str] = set()
        self._doubted = 0
        self._view_ns: int | None = None
        self._since_ns = 0
        self._asked_ns = 0
        self._begins_anew = False
        self._waits_ns = deque([0] * KEPT_WAITS, KEPT_WAITS)

    def on_presence(self, presence: Presence) -> None:
        """Note who leaves, and who comes back."""
        if not presence.alive:
            self._away.add(presence.instance)
        elif presence.instance in self._away:
            self._away.remove(presence.instance)
            self.doubt()

    def doubt(self) -> None:
        """Take account that messages may be lost, as after a restart of whoever publishes views.
        The wait begins anew: whoever has come back may have something to do yet.
        """
        self._doubted = DOUBTED_VIEWS
        self._begins_anew = True

    def on_answer(self) -> None:
        """Note that the newest view is answered."""
        self._doubted = max(0, self._doubted - 1)

    def is_due(self, view_ns: int, wall_ns: int) -> bool:
        """Decide at a wall time whether the view of `view_ns`, which nobody has answered, is to be
        published again now.
        """
        if view_ns != self._view_ns:
            if self._view_ns is not None:
                self._waits_ns.append(wall_ns - self._since_ns)
            self._view_ns = view_ns
            self._since_ns = wall_ns
            self._begins_anew = True

        if self._begins_anew:
            self._begins_anew = False
            self._asked_ns = wall_ns

        if wall_ns - self._asked_ns < self._patience_ns:
            return False

        self._asked_ns = wall_ns
        return True

    @property
    def _patience_ns(self) -> float:
        usual_ns = median(self._waits_ns)
        if not self._doubted:
            is_known = min(self._waits_ns) > 0
            patience_ns = max(UNDOUBTED_AFTER_NS, UNDOUBTED_TIMES_USUAL * usual_ns)
            return min(REPEAT_AFTER_NS, patience_ns) if is_known else REPEAT_AFTER_NS

        return min(REPEAT_AFTER_NS, max(DOUBTED_AFTER_NS, TIMES_USUAL * usual_ns))
