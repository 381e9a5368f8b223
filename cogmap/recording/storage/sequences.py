"""Whether a log is complete, from the numbers that each source puts on its messages."""

from __future__ import annotations

from dataclasses import dataclass, field

from cogmap.bus.codec import UNKNOWN, Envelope
from cogmap.schemas.topics import Delivery, Topic

_MAX_SPANS = 4
Span = tuple[int, int]
Key = tuple[str, str, int]


@dataclass
class Stream:
    """The numbers of one source on one topic in one incarnation.

    `missing` are spans [start, end) of numbers up to `last` that have not come. `earlier` counts
    the messages that the source published in earlier incarnations, UNKNOWN if it does not.
    """

    topic: Topic
    source: str
    incarnation: int
    earlier: int
    last: int
    missing: list[Span] = field(default_factory=list)

    @property
    def lost(self) -> int:
        """Return how many numbers are missing."""
        lost = 0
        for start, end in self.missing:
            lost += end - start
        return lost

    def follow(self, seq: int) -> None:
        """Take note of the next number; one that was thought lost may come late."""
        if seq > self.last + 1:
            self.missing.append((self.last + 1, seq))
        elif seq <= self.last:
            spans: list[Span] = []
            for start, end in self.missing:
                is_in = start <= seq < end
                parts = ((start, seq), (seq + 1, end)) if is_in else ((start, end),)
                spans += [part for part in parts if part[0] < part[1]]
            self.missing = spans
        self.last = max(self.last, seq)

    def end(self, published: int) -> None:
        """Take note that the source published that many messages in all before it was restarted."""
        awaited = self.last + 1
        if published > awaited:
            self.missing.append((awaited, published))
            self.last = published - 1


class SequenceTracker:
    """Follows the numbers of every source on every topic, from one incarnation to the next.

    A source whose incarnation began after `since_ns` should be there from number 0; on NEVER_DROP
    topics already one that began after `continues_ns`.
    """

    def __init__(self, since_ns: int | None = None, continues_ns: int | None = None) -> None:
        self._since_ns = since_ns
        self._continues_ns = since_ns if continues_ns is None else continues_ns
        self._streams: dict[Key, Stream] = {}
        self._newest: dict[tuple[str, str], Stream] = {}

    def follow(self, topic: Topic, envelope: Envelope) -> None:
        """Take note of one message."""
        key = (topic.name, envelope.source, envelope.incarnation)
        stream = self._streams.get(key)
        if stream is not None:
            stream.follow(envelope.seq)
            return

        stream = Stream(
            topic=topic,
            source=envelope.source,
            incarnation=envelope.incarnation,
            earlier=envelope.earlier,
            last=envelope.seq,
        )
        self._streams[key] = stream
        is_kept = topic.delivery is Delivery.NEVER_DROP
        since_ns = self._continues_ns if is_kept else self._since_ns
        is_new = since_ns is not None and stream.incarnation > since_ns
        if is_new and stream.last > 0:
            stream.missing.append((0, stream.last))

        # The source's stream before it has ended.
        of_source = topic.name, stream.source
        before = self._newest.get(of_source)
        self._newest[of_source] = stream
        if before is not None and UNKNOWN not in (before.earlier, stream.earlier):
            before.end(stream.earlier - before.earlier)

    @property
    def streams(self) -> list[Stream]:
        """Return all streams, by topic, source and incarnation."""
        return [self._streams[key] for key in sorted(self._streams)]

    def reached(self) -> dict[str, dict[str, int]]:
        """Return by topic and source how many messages the source had published, in all its
        incarnations, with the last one that came; without those that do not count them.
        """
        reached: dict[str, dict[str, int]] = {}
        for stream in self._newest.values():
            if stream.earlier != UNKNOWN:
                of_topic = reached.setdefault(stream.topic.name, {})
                of_topic[stream.source] = stream.earlier + stream.last + 1
        return reached

    def gaps(self) -> list[str]:
        """Return a sentence for each stream that misses numbers, those of NEVER_DROP topics
        first.
        """
        broken = [stream for stream in self.streams if stream.missing]
        broken.sort(key=lambda stream: stream.topic.delivery is not Delivery.NEVER_DROP)
        sentences = []
        for stream in broken:
            spans = []
            for start, end in stream.missing[:_MAX_SPANS]:
                spans.append(f"{start}" if start == end - 1 else f"{start} to {end - 1}")
            rest = len(stream.missing) - _MAX_SPANS
            more = f" and {rest} more spans" if rest > 0 else ""
            sentences.append(
                f"{stream.topic.name} ({stream.topic.delivery.value}): {stream.lost} of "
                f"{stream.source} missing, number {', '.join(spans)}{more}"
            )

        return sentences

    def lost(self) -> dict[str, int]:
        """Return how many messages are missing, by topic."""
        lost: dict[str, int] = {}
        for stream in self.streams:
            if stream.missing:
                name = stream.topic.name
                lost[name] = lost.get(name, 0) + stream.lost
        return lost
