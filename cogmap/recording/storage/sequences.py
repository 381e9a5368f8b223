"""Whether a log is whole, from the numbers that each source puts on its messages."""

from __future__ import annotations

from dataclasses import dataclass, field

from cogmap.bus.codec import Envelope
from schemas.topics import Delivery, Topic


@dataclass
class Thread:
    """The numbers of one source on one topic in one incarnation: `first`, `last` and those between
    that lack.
    """

    topic: Topic
    source: str
    incarnation: int
    first: int
    last: int
    count: int = 1
    lacking: list[tuple[int, int]] = field(default_factory=list)

    @property
    def lost(self) -> int:
        """How many numbers lack."""
        return sum(end - start for start, end in self.lacking)

    def follow(self, seq: int) -> None:
        """Take note of the next number; one that was thought lost may come late."""
        self.count += 1
        if seq > self.last + 1:
            self.lacking.append((self.last + 1, seq))
        elif seq <= self.last:
            self.lacking = [part for span in self.lacking for part in _without(span, seq)]
        self.last = max(self.last, seq)


def _without(span: tuple[int, int], seq: int) -> list[tuple[int, int]]:
    start, end = span
    if not start <= seq < end:
        return [span]
    return [part for part in ((start, seq), (seq + 1, end)) if part[0] < part[1]]


class Continuity:
    """Follows every source on every topic. `since_ns`: whoever began after it should be there from
    number 0.
    """

    def __init__(self, since_ns: int | None = None) -> None:
        self._since_ns = since_ns
        self._threads: dict[tuple[str, str, int], Thread] = {}

    def follow(self, topic: Topic, envelope: Envelope) -> None:
        """Take note of one message."""
        key = (topic.name, envelope.source, envelope.incarnation)
        thread = self._threads.get(key)
        if thread is not None:
            thread.follow(envelope.seq)
            return
        thread = self._threads[key] = Thread(
            topic, envelope.source, envelope.incarnation, envelope.seq, envelope.seq
        )
        if (
            self._since_ns is not None
            and envelope.incarnation > self._since_ns
            and envelope.seq > 0
        ):
            thread.lacking.append((0, envelope.seq))

    @property
    def threads(self) -> list[Thread]:
        """All, by topic, source and incarnation."""
        return [self._threads[key] for key in sorted(self._threads)]

    def gaps(self) -> list[str]:
        """A sentence for each gap, those of NEVER_DROP topics first."""
        broken = sorted(
            (t for t in self.threads if t.lacking), key=lambda t: t.topic.delivery is not _NEVER
        )
        return [_sentence(thread) for thread in broken]

    def lost(self) -> dict[str, int]:
        """How many messages lack, by topic."""
        lost: dict[str, int] = {}
        for thread in self.threads:
            if thread.lacking:
                lost[thread.topic.name] = lost.get(thread.topic.name, 0) + thread.lost
        return lost


_NEVER = Delivery.NEVER_DROP
_SHOWN = 4


def _sentence(thread: Thread) -> str:
    spans = [
        f"{start}" if end == start + 1 else f"{start} to {end - 1}"
        for start, end in thread.lacking[:_SHOWN]
    ]
    more = f" and {len(thread.lacking) - _SHOWN} more spans" if len(thread.lacking) > _SHOWN else ""
    return (
        f"{thread.topic.name} ({thread.topic.delivery.value}): {thread.lost} of {thread.source} lacking, "
        f"number {', '.join(spans)}{more}"
    )
