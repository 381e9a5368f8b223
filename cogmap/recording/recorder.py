"""Records what travels on a bus: checks every message, counts every loss, blocks no publisher."""

from __future__ import annotations

import logging
import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
from mcap.writer import CompressionType

from cogmap.bus.interface import Arrival, Bus, Member
from cogmap.errors import LogError
from cogmap.recording.completeness import began_ns, sequence_of
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.recent import Recent
from cogmap.recording.storage.sequences import SequenceTracker
from cogmap.recording.storage.write_queue import LIMIT_BYTES, WriteQueue
from cogmap.recording.storage.writer import FlushTimer, LogWriter, check_new
from cogmap.runtime.delivery.intake import Intake, number_of
from cogmap.runtime.delivery.plausibility import Plausibility
from cogmap.runtime.delivery.recovery import TIMEOUT_S, Recovery
from cogmap.schemas.topics import BY_NAME, Delivery, Topic

log = logging.getLogger("cogmap")
MODULE = "recorder"
# How often it looks whether it is to stop.
IDLE_S = 0.25
# The most time that fetching may take when it ends: what has come is to be written then, and who
# started it waits ten seconds.
LAST_FETCH_S = 3.0
# The greatest number of a message.
LAST_NUMBER = 2**63 - 1


class Summary(msgspec.Struct, kw_only=True):
    """How a recording went. Counts are of messages, by topic.

    `lost`: missing by the sources' numbers, in the logs that it continues too; `unrecovered`: given
    up by the bus, and not to be had from their sources; `dropped`: found no room here; `rejected`:
    were no messages of their topic. `gaps` are sentences; `never_drop_whole`: no NEVER_DROP topic
    misses any. `queue_peak_mb` is the most that ever waited to be written. `left_out` were received
    and not written: while it was paused, or earlier than a snapshot goes back. `paths` are the
    files, more than one if the recording was split and one for each snapshot: each file has the
    summary of all that was recorded until its end. `reached` has by topic and source how many
    messages the source had published with the last one recorded; `fetched` are those that the bus
    did not deliver, from who had published them.
    """

    path: str
    duration_s: float
    size_bytes: int
    messages: dict[str, int]
    lost: dict[str, int]
    unrecovered: dict[str, int]
    dropped: dict[str, int]
    rejected: dict[str, int]
    gaps: list[str]
    never_drop_whole: bool
    queue_peak_mb: float = 0.0
    left_out: dict[str, int] = {}
    paths: list[str] = []
    reached: dict[str, dict[str, int]] = {}
    fetched: dict[str, int] = {}


@dataclass(frozen=True, kw_only=True)
class Split:
    """When another file begins: once one is so large, or so old. Without either, never. Of those
    that are finished, the newest `keep` stay; None for all.
    """

    max_bytes: float = math.inf
    max_s: float = math.inf
    keep: int | None = None


WHOLE = Split()


class Recorder:
    """Writes every message on `topics` to a new log at `path`. `open()` it, `pump()` it from one
    thread, `close()` it.

    `about` is kept in the file: the agent, the configuration, what else is to be known of the run.
    `limit_bytes` may wait to be written. Where the recording is `split`, files follow whose names
    have a number, such as `drive-2.mcap`. With `snapshot_s` nothing is written but what a
    `snapshot()` finds: the messages of the last `snapshot_s`, at most `limit_bytes` of them, in a
    file of its own. It continues the logs `after`, of earlier recorders of the run: it fetches what
    these lack from the sources, and counts what these do not have. Raises LogError if the file
    cannot be written.
    """

    def __init__(
        self,
        bus: Bus,
        path: Path,
        topics: Sequence[Topic],
        about: Mapping[str, str],
        *,
        limit_bytes: int = LIMIT_BYTES,
        instance: str = MODULE,
        compression: CompressionType = CompressionType.LZ4,
        split: Split = WHOLE,
        snapshot_s: float | None = None,
        after: Sequence[Path] = (),
    ) -> None:
        self._bus = bus
        self._topics = topics
        self._about = about
        self._instance = instance
        self._compression = compression
        self._split = split
        self._path = path
        self._paths: list[Path] = []
        self._begun = 0
        self._size_bytes = 0
        self._recent: Recent | None = None
        self._writer: LogWriter | None = None
        if snapshot_s is None:
            self._writer = self._opened()
        else:
            check_new(path)
            self._recent = Recent(snapshot_s, limit_bytes)
        self.is_paused = False
        self._queue = WriteQueue(limit_bytes)
        now_ns = time.time_ns()
        continues_ns = began_ns(after, now_ns)
        self._intake = Intake(Plausibility(), since_ns=continues_ns)
        self._recovery = Recovery(bus, self._intake)
        self._after = after
        self._fetched: Counter[str] = Counter()
        self._fetched_to: dict[tuple[Topic, str], int] = {}
        self._fetches_until_s = math.inf
        self._flush_timer = FlushTimer()
        self._sequences = SequenceTracker(now_ns, continues_ns)
        self._unrecovered: Counter[str] = Counter()
        self._written: Counter[str] = Counter()
        self._left_out: Counter[str] = Counter()
        self._began_s = self._part_began_s = time.monotonic()

    @property
    def path(self) -> Path:
        """Return the file that it writes, the first of several."""
        return self._path

    @property
    def takes_snapshots(self) -> bool:
        """Return whether only snapshots are written."""
        return self._recent is not None

    @property
    def received(self) -> Counter[str]:
        """Return how many messages of each topic have been written."""
        return self._written

    def open(self) -> None:
        """Join the bus and announce itself: all that is published from now on is recorded, and what
        the logs that it continues lack of what was published before.
        """
        for topic, envelope in sequence_of(self._after):
            self._sequences.follow(topic, envelope)
            self._intake.resume(topic, envelope)
        if self._after:
            self._queue.call(self._fetch_rest)
        for topic in self._topics:
            self._bus.subscribe(topic, self._queue.put, self.on_gap)
        self._bus.watch(self.on_member)
        self._bus.announce(Member(MODULE, self._instance))

    def pump(self, timeout_s: float | None = 0.0) -> bool:
        """Write the oldest arrival, waiting up to `timeout_s` for one, and flush when it is time.

        Returns whether one came. Raises LogError if the disk takes no more.
        """
        due_s = self._flush_timer.due_in_s()
        found = self._take(due_s if timeout_s is None else min(timeout_s, due_s))
        if self._flush_timer.due_in_s() == 0.0:
            self.flush()
        return found

    def flush(self) -> None:
        """Write out what has been received, and begin another file if this one is as large, or as
        old, as one may be. Raises LogError if the disk takes no more.
        """
        self._flush_timer.reset()
        if self._writer is None:
            return

        self._writer.flush()
        age_s = time.monotonic() - self._part_began_s
        if age_s >= self._split.max_s or self._writer.size_bytes >= self._split.max_bytes:
            self._finish(self._writer)
            self._writer = self._opened()
            self._part_began_s = time.monotonic()

    def snapshot(self) -> Path:
        """Write the messages of the last seconds into a new file, and return its path; they are in
        no later one. Raises LogError if the disk takes no more.
        """
        assert self._recent is not None
        writer = self._opened()
        for arrival in self._recent.take_all():
            self._write(writer, arrival)
        self._finish(writer)
        return writer.path

    def close(self, fetch_s: float = LAST_FETCH_S) -> Summary:
        """Write what waits and, in `fetch_s` at most, what the bus has not delivered yet, leave the
        bus, and finish the file. What is not fetched by then is counted as lost. Raises LogError.
        """
        self._fetches_until_s = time.monotonic() + fetch_s
        while self._may_fetch and self._take(0.0):
            pass
        self._fetch_rest()
        self._bus.close()
        while self._take(0.0):
            pass
        if self._writer is None:
            return self._summary()
        return self._finish(self._writer)

    @property
    def _may_fetch(self) -> bool:
        return time.monotonic() < self._fetches_until_s

    def _opened(self) -> LogWriter:
        """Begin a file: the first by the name that was given, others with a number."""
        path = self._path
        self._begun += 1
        if self._begun > 1:
            path = path.with_stem(f"{path.stem}-{self._begun}")
        facts = {"began_ns": str(time.time_ns()), **self._about}
        writer = LogWriter(path, self._topics, facts, self._compression)
        self._remove_old()
        self._paths.append(path)
        return writer

    def _remove_old(self) -> None:
        """Remove the oldest finished files, so that as many stay as are to be kept."""
        keep = self._split.keep
        while keep is not None and len(self._paths) > keep:
            oldest = self._paths.pop(0)
            self._size_bytes -= oldest.stat().st_size
            oldest.unlink()

    def _finish(self, writer: LogWriter) -> Summary:
        """Finish a file. Returns the summary of the recording until now, which is noted in it."""
        summary = self._summary()
        writer.note(layout.SUMMARY, {"json": msgspec.json.encode(summary).decode()})
        writer.close()
        self._size_bytes += writer.path.stat().st_size
        summary.size_bytes = self._size_bytes
        return summary

    def _summary(self) -> Summary:
        lost = self._sequences.lost()
        dropped = dict(self._queue.dropped)
        given_up = {name: min(n, lost.get(name, 0)) for name, n in self._unrecovered.items()}
        unrecovered = {name: number for name, number in given_up.items() if number}
        incomplete = {*lost, *dropped, *unrecovered}
        never_drop = [name for name in incomplete if BY_NAME[name].delivery is Delivery.NEVER_DROP]
        return Summary(
            path=str(self.path),
            duration_s=time.monotonic() - self._began_s,
            size_bytes=self._size_bytes,
            messages=dict(self._written),
            lost=lost,
            unrecovered=unrecovered,
            dropped=dropped,
            rejected=dict(self._intake.rejected),
            gaps=self._sequences.gaps(),
            never_drop_whole=not never_drop,
            queue_peak_mb=self._queue.peak_bytes / 1e6,
            left_out=dict(self._left_out),
            paths=[str(path) for path in self._paths],
            reached=self._sequences.reached(),
            fetched=dict(self._fetched),
        )

    def abandon(self) -> None:
        """Leave the bus and write no more: the disk took no more."""
        self._bus.close()

    def on_gap(self, topic: str, number: int) -> None:
        """Count messages that the bus has given up."""

        def count() -> None:
            self._unrecovered[topic] += number

        self._queue.call(count)

    def on_member(self, member: Member, alive: bool) -> None:
        """Note in the log that a member has come or gone."""
        facts = {
            "module": member.module,
            "instance": member.instance,
            "alive": str(alive).lower(),
        }

        def note() -> None:
            if self._writer is not None:
                self._writer.note(layout.MEMBER, {**facts, "at_ns": str(time.time_ns())})

        self._queue.call(note)

    def _take(self, timeout_s: float) -> bool:
        """Write or do what has waited longest. Return whether there was anything."""
        item = self._queue.take(timeout_s)
        if item is None:
            return False
        if not isinstance(item, Arrival):
            item()
            return True

        if self._was_fetched(item):
            return True
        if self._may_fetch:
            for missed in self._recovery.before(item):
                self._accept_fetched(missed)
                if not self._may_fetch:
                    break
        self._accept(item)
        return True

    def _accept(self, arrival: Arrival) -> bool:
        """Record a message, if it is one. Returns whether it is."""
        message = self._intake.accept(arrival)
        if message is None or arrival.envelope is None:
            return False
        self._sequences.follow(arrival.topic, arrival.envelope)
        self._store(arrival)
        return True

    def _accept_fetched(self, arrival: Arrival) -> None:
        """Record a message that its source has given again."""
        self._fetched[arrival.topic.name] += self._accept(arrival)
        if self._flush_timer.due_in_s() == 0.0:
            self.flush()

    def _was_fetched(self, arrival: Arrival) -> bool:
        """Return whether a message comes over the bus that its source had given before."""
        number = number_of(arrival.envelope)
        if number is None or arrival.envelope is None:
            return False
        return number <= self._fetched_to.get((arrival.topic, arrival.envelope.source), -1)

    def _fetch_rest(self) -> None:
        """Fetch what the known sources have published since their last message here: they may
        publish no other that would show it.
        """
        for (topic, source), number in self._intake.received_up_to().items():
            left_s = self._fetches_until_s - time.monotonic()
            if left_s <= 0.0:
                return
            timeout_s = min(left_s, TIMEOUT_S)
            rest = self._recovery.fetch(
                topic, source, number + 1, LAST_NUMBER, timeout_s=timeout_s, tries=1
            )
            for missed in rest:
                self._accept_fetched(missed)
                self._fetched_to[topic, source] = number_of(missed.envelope) or 0
                if not self._may_fetch:
                    return

    def _store(self, arrival: Arrival) -> None:
        if self.is_paused:
            self._left_out[arrival.topic.name] += 1
        elif self._writer is not None:
            self._write(self._writer, arrival)
        elif self._recent is not None:
            self._left_out.update(gone.topic.name for gone in self._recent.put(arrival))

    def _write(self, writer: LogWriter, arrival: Arrival) -> None:
        writer.write(arrival.topic, arrival.payload, arrival.envelope, arrival.received_ns)
        self._written[arrival.topic.name] += 1


def run(
    recorder: Recorder, stop: Callable[[], bool], max_duration_s: float | None = None
) -> Summary:
    """Record until `stop()` is true or the time is over.

    Raises LogError if the disk takes no more; the log then holds what was flushed before.
    """
    recorder.open()
    log.info("recording to %s", recorder.path)
    end_s = math.inf if max_duration_s is None else time.monotonic() + max_duration_s
    try:
        while not stop() and (left_s := end_s - time.monotonic()) > 0:
            recorder.pump(min(IDLE_S, left_s))
    except LogError:
        recorder.abandon()
        raise
    return recorder.close()
