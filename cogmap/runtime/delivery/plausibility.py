"""Refuses what makes sense but cannot be true: a stamp or a number far from all before it. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from cogmap.errors import MessageError
from cogmap.schemas.base import Message
from cogmap.schemas.topics import HEALTH, Topic

AGREEING = 3
AGREED_NS = 1_000_000_000
"""So many messages must agree with one another, over so much wall time and with none between them
that agrees with what was accepted before, until they are believed. While the true ones come, at
least once a second, no flood is.
"""

JUMP_NS = 5_000_000_000
"""How far a stamp lies from those before, so that it is counted. Among the messages of five drives,
with cameras and with percepts, none lay more than 2 s behind.
"""


@dataclass(frozen=True)
class Kind:
    """Numbers that rise together in all messages, in the first of `fields` that a message has.

    One may differ by `most` from the one before. That is an hour: the pauses of a recording, and
    what a process misses that was stopped, are shorter. What lies within is no danger: no module
    keeps to it for longer than until its next message.
    """

    name: str
    fields: tuple[str, ...]
    most: int
    unit: str
    per_unit: int = 1

    def of(self, message: Message) -> int:
        """Return the number in a message; 0 if it states none."""
        for field in self.fields:
            number: int = getattr(message, field, 0)
            if number:
                return number
        return 0

    def in_words(self, difference: int) -> str:
        """Return how far a number lies from another one."""
        size = abs(difference) / self.per_unit
        return f"its {self.name} lies {size:,.0f} {self.unit} {_side(difference)}"


# Five cycles and views a second, and at most twenty commits in each.
HOUR_S = 3600
STAMP = Kind("stamp", ("stamp_ns",), HOUR_S * 10**9, "s", 10**9)
KINDS = (
    STAMP,
    Kind("cycle", ("cycle",), HOUR_S * 5, "cycles"),
    Kind("version", ("version", "base_version"), HOUR_S * 100, "versions"),
    Kind("frame", ("frame",), HOUR_S * 5, "views"),
)


@dataclass
class Course:
    """The last number of a kind that was accepted, None before the first, and those refused since
    that agree with one another: the last of them, how many, and since when.
    """

    last: int | None = None
    doubted: int = 0
    agreeing: int = 0
    since_ns: int = 0

    def accepts(self, number: int, most: int, now_ns: int) -> bool:
        """Decide whether a number follows from those before it, or from enough that agree."""
        if self.last is None or abs(number - self.last) <= most:
            return True

        if not self.agreeing or abs(number - self.doubted) > most:
            self.agreeing = 0
            self.since_ns = now_ns
        self.doubted = number
        self.agreeing += 1
        return self.agreeing >= AGREEING and now_ns - self.since_ns >= AGREED_NS

    def advance(self, number: int) -> None:
        """Make a number the last one."""
        self.last = number
        self.agreeing = 0


class Jumps:
    """Counts the messages whose stamps lie more than JUMP_NS from those before, of all topics.

    They are believed: a simulation may begin anew, a recording may pause.
    """

    def __init__(self) -> None:
        self._count = 0
        self._last = ""
        self._course = Course()
        self._wall_course = Course()

    def follow(self, topic: Topic, message: Message, now_ns: int) -> str:
        """Take account of a message. Returns a sentence if it lies far, empty if not."""
        stamp_ns = STAMP.of(message)
        if not stamp_ns:
            return ""
        course = self._wall_course if topic is HEALTH else self._course
        if course.accepts(stamp_ns, JUMP_NS, now_ns):
            course.advance(stamp_ns)
            return ""

        self._count += 1
        distance = STAMP.in_words(stamp_ns - (course.last or 0))
        self._last = f"{topic.name} of {message.source}: {distance} all before it"
        return self._last

    def notes(self) -> list[str]:
        """Return how many jumped, and which was the last."""
        if not self._count:
            return []
        return [f"{self._count} messages jumped in time, the last: {self._last}"]


class Plausibility:
    """Compares each message with those that one process accepted before, of all topics together.

    A number that is 0 states nothing. Whatever was accepted wrongly, the first message included,
    the true ones are believed again as soon as AGREEING of them have come, AGREED_NS apart.
    """

    def __init__(self) -> None:
        self.refused = 0
        self._last_reason = ""
        self._courses = {kind: Course() for kind in KINDS}
        self._wall_courses = {kind: Course() for kind in KINDS}
        self._jumps = Jumps()

    def check(self, topic: Topic, message: Message, now_ns: int) -> str:
        """Accept `message`, at `now_ns` by a monotonic clock. Returns what is strange about it,
        empty if nothing is. Raises MessageError if a number of it lies too far from those before.
        """
        stated = []
        courses = self._wall_courses if topic is HEALTH else self._courses
        for kind, course in courses.items():
            number = kind.of(message)
            if not number:
                continue
            if not course.accepts(number, kind.most, now_ns):
                self._refuse(topic, message, kind.in_words(number - (course.last or 0)))
            stated.append((course, number))

        for course, number in stated:
            course.advance(number)
        return self._jumps.follow(topic, message, now_ns)

    def notes(self) -> list[str]:
        """Return how many messages were refused, and why the last one; and how many jumped."""
        notes = self._jumps.notes()
        if self.refused:
            notes.append(
                f"{self.refused} messages were refused that cannot be true, the last: "
                f"{self._last_reason}"
            )
        return notes

    def _refuse(self, topic: Topic, message: Message, reason: str) -> None:
        self.refused += 1
        self._last_reason = f"{topic.name} of {message.source}: {reason} all before it"
        raise MessageError(self._last_reason)


def _side(difference: int) -> str:
    return "ahead of" if difference > 0 else "behind"
