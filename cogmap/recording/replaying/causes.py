"""Plans a replay from the causes in envelopes: the exact order of what each instance received."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from cogmap.bus.codec import Cause, Envelope
from cogmap.errors import LogError
from cogmap.recording.replaying.plan import (
    Job,
    Kind,
    Step,
    inexact_jobs,
    modules_of,
    of_model,
    without_envelope,
)
from cogmap.recording.storage.reader import LogReader, Progress, Record
from cogmap.runtime.shell import START, TIMER
from cogmap.schemas.topics import SNAPSHOT


def jobs(reader: LogReader, modules: Sequence[str], progress: Progress | None = None) -> list[Job]:
    """Return the jobs that replay `modules`, in the order of the log.

    Raises LogError if one of them published nothing in it.
    """
    records = list(reader.records(progress=progress))
    has_envelopes = all(record.envelope is not None for record in records)
    if not has_envelopes:
        return inexact_jobs(reader, records, modules)

    planner = _Planner(records)
    found = []
    for source, module in modules_of(reader, planner.sources, modules).items():
        found += planner.jobs(source, module)
    return found


class _Planner:
    """Plans from all `records` of a log, every one with its envelope."""

    def __init__(self, records: list[Record]) -> None:
        self._by_cause: dict[Cause, list[Record]] = defaultdict(list)
        self._published: dict[str, dict[int, list[Record]]] = defaultdict(lambda: defaultdict(list))
        for record in records:
            envelope = _envelope(record)
            cause = (record.topic.name, envelope.source, envelope.seq)
            self._by_cause[cause].append(record)
            self._published[envelope.source][envelope.incarnation].append(record)

    @property
    def sources(self) -> list[str]:
        """Return every instance that published something."""
        return sorted(self._published)

    def jobs(self, source: str, module: str) -> list[Job]:
        """Return a job for each incarnation of an instance in which something happened."""
        found: list[Job] = []
        earlier: list[Record] = []
        for number, incarnation in enumerate(sorted(self._published[source])):
            published = sorted(self._published[source][incarnation], key=_sent_ns)
            job = Job(module, source, number, earlier=list(earlier))
            inputs = _Inputs(self._by_cause, incarnation)
            numbered = []
            for record in published:
                envelope = _envelope(record)
                numbered.append((envelope.seq, without_envelope(record)))
                for cause in envelope.causes:
                    step = inputs.step(cause, envelope.sent_ns)
                    if step is None:
                        job.missing[cause[0]] += 1
                    else:
                        job.steps.append(step)

            job.expected = of_model(numbered)
            if job.steps or job.expected:
                found.append(job)
            earlier += [without_envelope(record) for record in published]
        return found


class _Inputs:
    """Finds the messages that causes name, for one consumer that began at `since_ns`.

    A source that was restarted numbers its messages anew, so a cause may name several: numbers rise
    within an incarnation, a source's incarnations follow one another, and nothing is received that
    was sent before the consumer began.
    """

    def __init__(self, by_cause: dict[Cause, list[Record]], since_ns: int) -> None:
        self._by_cause = by_cause
        self._since_ns = since_ns
        self._incarnation: dict[str, int] = {}
        self._last: dict[tuple[str, str], int] = {}

    def step(self, cause: Cause, before_ns: int) -> Step | None:
        """Return what `cause` names, before the message that names it; None if the log lacks it."""
        topic, source, seq = cause
        if topic == START:
            return Step(Kind.START)
        if topic == TIMER:
            return Step(Kind.TIMER, at_ns=seq)
        if topic == SNAPSHOT.name:
            return Step(Kind.SNAPSHOT, at_ns=before_ns, version=seq)

        candidates = self._by_cause.get(cause)
        if not candidates:
            return None

        # The candidate of the first incarnation that it can be of; the last one if none can.
        record = candidates[0]
        current = self._incarnation.get(source)
        if len(candidates) > 1:
            if current is None:
                fitting = [each for each in candidates if _sent_ns(each) >= self._since_ns]
            else:
                last = self._last.get((topic, source), -1)
                first = current + 1 if seq <= last else current
                fitting = [each for each in candidates if _incarnation(each) >= first]
            record = min(fitting, key=_incarnation, default=candidates[-1])

        incarnation = _incarnation(record)
        if current != incarnation:
            # The numbers of a source's earlier incarnations say nothing about this one.
            self._incarnation[source] = incarnation
            self._last = {key: last for key, last in self._last.items() if key[1] != source}
        self._last[topic, source] = seq
        return Step(Kind.FEED, without_envelope(record))


def _envelope(record: Record) -> Envelope:
    if record.envelope is None:
        raise LogError("a message in the log has no envelope")
    return record.envelope


def _incarnation(record: Record) -> int:
    return _envelope(record).incarnation


def _sent_ns(record: Record) -> int:
    return _envelope(record).sent_ns
