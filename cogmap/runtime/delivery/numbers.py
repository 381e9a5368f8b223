"""The numbers that have come of one incarnation of a source on a topic."""

from __future__ import annotations

from bisect import bisect_right

from cogmap.errors import MessageError

MAX_JUMP = 65_536
"""How far ahead of the last a number may be: 64 caches of a publisher, or 13 minutes of the topic
with most messages that must not be lost, 83 deltas a second as an agent drives.
"""
MIN_RUN = 3
"""So many numbers in a row are believed, however far ahead: a long gap, and no stray."""
MAX_RANGES = 64


class Jump:
    """The last numbers in a row that are too far ahead to be believed one by one."""

    def __init__(self) -> None:
        self._last = -1
        self._length = 0

    def check(self, number: int, last: int) -> None:
        """Compare a number with the `last` that was believed. Raises MessageError if it is too far
        ahead to be believed yet.
        """
        ahead = number - last
        if ahead <= MAX_JUMP:
            self._length = 0
            return

        follows = self._length > 0 and number == self._last + 1
        self._length = self._length + 1 if follows else 1
        self._last = number
        if self._length < MIN_RUN:
            raise MessageError(f"is {ahead} ahead of the last, at most {MAX_JUMP} are believed")

    def end(self) -> None:
        """Note that one came that is not ahead."""
        self._length = 0


class Newest:
    """The newest number of a source of whose messages any may be missing."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._jump = Jump()

    def add(self, number: int) -> None:
        """Take account of a number. Raises MessageError if it cannot be believed yet."""
        if self._last is not None:
            self._jump.check(number, self._last)
        self._last = number


class Numbers:
    """The ranges (first, last) of the numbers received, in order.

    A number that is in none is new, wherever it is: one stray far ahead hides none of the source's
    own, which go on where they were. `first` is the number that came first.
    """

    def __init__(self, first: int) -> None:
        self._firsts = [first]
        self._lasts = [first]
        self._jump = Jump()

    @property
    def last(self) -> int:
        """Return the greatest number."""
        return self._lasts[-1]

    def add(self, number: int) -> int:
        """Add `number`. Returns how many more numbers are missing by it: -1 if it was missing.

        Raises MessageError if it came before, or is too far ahead to be believed yet.
        """
        ahead = number - self.last
        if ahead == 1:
            self._lasts[-1] = number
            self._jump.end()
            return 0

        place = bisect_right(self._firsts, number)
        if place > 0 and number <= self._lasts[place - 1]:
            raise MessageError("came twice")
        self._jump.check(number, self.last)
        return self._insert(place, number)

    def _insert(self, place: int, number: int) -> int:
        """Insert a number before the range `place`, and join the ranges that it touches."""
        firsts, lasts = self._firsts, self._lasts
        ahead = number - lasts[-1]
        is_before_first = place == 0
        before_all = firsts[0]
        joins_left = place > 0 and lasts[place - 1] == number - 1
        joins_right = place < len(firsts) and firsts[place] == number + 1
        if joins_left and joins_right:
            lasts[place - 1] = lasts.pop(place)
            del firsts[place]
        elif joins_left:
            lasts[place - 1] = number
        elif joins_right:
            firsts[place] = number
        else:
            firsts.insert(place, number)
            lasts.insert(place, number)

        if len(firsts) > MAX_RANGES:
            # What is missing between the first two is lost for good.
            del firsts[1]
            del lasts[0]

        if ahead > 0:
            return ahead - 1
        return before_all - number - 1 if is_before_first else -1
