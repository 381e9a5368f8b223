"""Records what travels on a bus. It believes nothing, loses nothing unsaid, and never holds anybody
up.
"""

from __future__ import annotations

import logging
import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import msgspec

from cogmap.bus.interface import Arrival, Bus, Member
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.sequences import Continuity
from cogmap.recording.storage.write_queue import LIMIT_BYTES, Backlog
from cogmap.recording.storage.writer import LogWriter, Pulse
from cogmap.runtime.intake import Intake
from schemas.topics import BY_NAME, Delivery, Topic

log = logging.getLogger("cogmap")
MODULE = "recorder"
IDLE_S = 0.25


class Summary(msgspec.Struct, kw_only=True):
    """How a recording went, by topic. `gaps` are sentences; `never_drop_whole` says that no
    NEVER_DROP topic lacks any.

    `lost` counts by the sources' numbers, `unrecovered` what the bus gave up, `dropped` what found
    no room here, `rejected` what was no message. `backlog_peak_mb` is the most that ever waited to
    be written.
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
    backlog_peak_mb: float


class Recorder:
    """Writes every message on `topics` to a new log at `path`. `open()` it, `pump()` it from one
    thread, `close()` it.

    `about` is kept in the file: the agent, and what else is to be known of the run. Raises
    LogError.
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
    ) -> None:
        now_ns = time.time_ns()
        self._bus = bus
        self._topics = topics
        self._instance = instance
        self._writer = LogWriter(
            path, topics, {"began_ns": str(now_ns), "software": layout.software(), **about}
        )
        self._backlog, self._intake, self._pulse = Backlog(limit_bytes), Intake(), Pulse()
        self._continuity = Continuity(since_ns=now_ns)
        self._unrecovered: Counter[str] = Counter()
        self._began_s = time.monotonic()

    @property
    def path(self) -> Path:
        """The file that it writes."""
        return self._writer.path

    @property
    def received(self) -> Counter[str]:
        """How many messages of each topic have been written."""
        return self._intake.received

    def open(self) -> None:
        """Join the bus, and tell everybody: all that is sent from now on is recorded."""
        for topic in self._topics:
            self._bus.subscribe(topic, self._backlog.put, self._on_gap)
        self._bus.watch(
            lambda member, alive: self._backlog.call(lambda: self._note_member(member, alive))
        )
        self._bus.announce(Member(MODULE, self._instance))

    def pump(self, timeout_s: float | None = 0.0) -> bool:
        """Write the oldest arrival, waiting up to `timeout_s` for one, and flush when it is time.
        False if none came.

        Raises LogError where the disk takes no more.
        """
        due_s = self._pulse.due_in_s()
        found = self._take(due_s if timeout_s is None else min(timeout_s, due_s))
        if self._pulse.due_in_s() == 0.0:
            self._writer.flush()
            self._pulse.reset()
        return found

    def close(self) -> Summary:
        """Leave the bus, write what waits, and finish the file. Raises LogError."""
        self._bus.close()
        while self._take(0.0):
            pass
        summary = self._summary()
        self._writer.note(layout.SUMMARY, {"json": msgspec.json.encode(summary).decode()})
        self._writer.close()
        summary.size_bytes = self.path.stat().st_size
        return summary

    def _take(self, timeout_s: float) -> bool:
        item = self._backlog.take(timeout_s)
        if isinstance(item, Arrival):
            self._write(item)
        elif item is not None:
            item()
        return item is not None

    def _write(self, arrival: Arrival) -> None:
        if self._intake.accept(arrival) is None or arrival.envelope is None:
            return
        self._continuity.follow(arrival.topic, arrival.envelope)
        self._writer.write(arrival.topic, arrival.payload, arrival.envelope, arrival.received_ns)

    def _on_gap(self, topic: str, number: int) -> None:
        self._backlog.call(lambda: self._unrecovered.update({topic: number}))

    def _note_member(self, member: Member, alive: bool) -> None:
        facts = {"module": member.module, "instance": member.instance, "alive": str(alive).lower()}
        self._writer.note(layout.MEMBER, {**facts, "at_ns": str(time.time_ns())})

    def _summary(self) -> Summary:
        lost = self._continuity.lost()
        dropped = dict(self._backlog.dropped)
        lacking = {*lost, *dropped, *self._unrecovered}
        return Summary(
            path=str(self.path),
            duration_s=time.monotonic() - self._began_s,
            size_bytes=0,
            messages=dict(self._intake.received),
            lost=lost,
            unrecovered=dict(self._unrecovered),
            dropped=dropped,
            rejected=dict(self._intake.rejected),
            gaps=self._continuity.gaps(),
            never_drop_whole=not any(
                BY_NAME[name].delivery is Delivery.NEVER_DROP for name in lacking
            ),
            backlog_peak_mb=self._backlog.peak_bytes / 1e6,
        )


def run(
    recorder: Recorder, stop: Callable[[], bool], max_duration_s: float | None = None
) -> Summary:
    """Record until `stop` says so or the time is over. Raises LogError."""
    recorder.open()
    log.info("recording to %s", recorder.path)
    end_s = math.inf if max_duration_s is None else time.monotonic() + max_duration_s
    while not stop() and (left_s := end_s - time.monotonic()) > 0:
        recorder.pump(min(IDLE_S, left_s))
    return recorder.close()
