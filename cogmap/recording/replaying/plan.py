"""What each recorded instance of a module took in, in what order, and what it said: read out of a
log.
"""

from __future__ import annotations

import enum
import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from cogmap.bus.codec import Cause, Envelope
from cogmap.errors import LogError
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.reader import LogReader, Progress, Record
from cogmap.runtime.shell import START, TIMER
from schemas.topics import PRESENCE, SNAPSHOT, About


class Kind(enum.Enum):
    """What a module can be made to do."""

    FEED = enum.auto()
    START = enum.auto()
    TIMER = enum.auto()
    SNAPSHOT = enum.auto()


@dataclass(frozen=True, slots=True)
class Step:
    """One event in a module's life: a received message, its start, its timer at `at_ns`, or that
    the graph it follows was loaded at `version`, before `at_ns`.
    """

    kind: Kind
    record: Record | None = None
    at_ns: int = 0
    version: int = 0


@dataclass
class Job:
    """One incarnation of an instance: what to do to it, and what it said, by topic and number.

    `earlier` are the messages of its former incarnations, for a module that keeps a journal.
    `exact` says that the order of its inputs is known; else it is that of the log, and the module
    takes of them what it handles.
    """

    module: str
    instance: str
    number: int
    steps: list[Step] = field(default_factory=list)
    expected: dict[str, dict[int, Record]] = field(default_factory=dict)
    earlier: list[Record] = field(default_factory=list)
    exact: bool = True
    missing: Counter[str] = field(default_factory=Counter)

    @property
    def input_bytes(self) -> int:
        """How much it takes in."""
        return sum(step.record.size for step in self.steps if step.record is not None)


def recorded_sections(reader: LogReader) -> dict[str, dict[str, Any]]:
    """The configuration that the log was recorded with. Raises LogError where it is not one."""
    try:
        sections = json.loads(reader.about(layout.RECORDING).get("config", "{}"))
    except json.JSONDecodeError as error:
        raise LogError(
            f"{reader.path} holds a configuration that cannot be read: {error}"
        ) from None
    if not isinstance(sections, dict):
        raise LogError(f"{reader.path} holds a configuration without sections")
    return sections


def jobs(reader: LogReader, modules: Sequence[str], progress: Progress | None = None) -> list[Job]:
    """The jobs that replay `modules`, in the order of the log. Raises LogError where one said
    nothing in it.
    """
    records = list(reader.records(progress=progress))
    is_exact = all(record.envelope is not None for record in records)
    exact = _Exact(records) if is_exact else None
    sources = (
        exact.sources
        if exact is not None
        else sorted({reader.stub(record).source for record in records})
    )
    modules_of = _modules_of(reader)
    module_of = {
        source: name
        for source in sources
        if (name := _module(source, modules_of, modules)) is not None
    }
    for name in modules:
        if name not in module_of.values():
            raise LogError(
                f"{reader.path} holds nothing that module {name} said: there are {', '.join(sources)}"
            )
    return exact.jobs(module_of) if exact is not None else _inexact(reader, records, module_of)


def _modules_of(reader: LogReader) -> dict[str, str]:
    notes = (facts for name, facts in reader.metadata if name == layout.MEMBER)
    return {facts.get("instance", ""): facts.get("module", "") for facts in notes}


def _module(source: str, modules_of: dict[str, str], modules: Iterable[str]) -> str | None:
    """Which of `modules` the instance `source` is one of: as the recorder saw it, else as its name
    says.
    """
    if source in modules_of:
        return modules_of[source] if modules_of[source] in modules else None
    return next((name for name in modules if source == name or source.startswith(f"{name}-")), None)


def _of_model(records: Iterable[tuple[int, Record]]) -> dict[str, dict[int, Record]]:
    expected: dict[str, dict[int, Record]] = defaultdict(dict)
    for seq, record in records:
        if record.topic.about is About.MODEL:
            expected[record.topic.name][seq] = record
    return dict(expected)


class _Exact:
    """The records of a log whose envelopes tell the causes of each message."""

    def __init__(self, records: list[Record]) -> None:
        self._by_key: dict[Cause, list[Record]] = defaultdict(list)
        self._said: dict[str, dict[int, list[Record]]] = defaultdict(lambda: defaultdict(list))
        for record in records:
            envelope = _envelope(record)
            self._by_key[record.topic.name, envelope.source, envelope.seq].append(record)
            self._said[envelope.source][envelope.incarnation].append(record)

    def jobs(self, module_of: dict[str, str]) -> list[Job]:
        """A job for each incarnation of each instance in `module_of` (instance: module)."""
        found = []
        for source, module in module_of.items():
            earlier: list[Record] = []
            for number, incarnation in enumerate(sorted(self._said[source])):
                said = sorted(
                    self._said[source][incarnation], key=lambda record: _envelope(record).sent_ns
                )
                found.append(self._job(Job(module, source, number, earlier=list(earlier)), said))
                earlier += [_bare(record) for record in said]
        return [job for job in found if job.steps or job.expected]

    @property
    def sources(self) -> list[str]:
        """Every instance that said something."""
        return sorted(self._said)

    def _job(self, job: Job, said: list[Record]) -> Job:
        inputs = _Inputs(self._by_key, _envelope(said[0]).incarnation)
        for record in said:
            for cause in _envelope(record).causes:
                name, _, seq = cause
                if name == START:
                    job.steps.append(Step(Kind.START))
                elif name == TIMER:
                    job.steps.append(Step(Kind.TIMER, at_ns=seq))
                elif name == SNAPSHOT.name:
                    before_ns = _envelope(record).sent_ns
                    job.steps.append(Step(Kind.SNAPSHOT, at_ns=before_ns, version=seq))
                elif (found := inputs.find(cause)) is not None:
                    job.steps.append(Step(Kind.FEED, _bare(found)))
                else:
                    job.missing[name] += 1
        job.expected = _of_model((_envelope(record).seq, _bare(record)) for record in said)
        return job


class _Inputs:
    """Finds the messages that causes name, for one consumer that began at `since_ns`.

    A source that was restarted numbers its messages anew, so a cause may name several: numbers rise
    within an incarnation, a source's incarnations come one after the other, and nothing comes that
    was sent before one began.
    """

    def __init__(self, by_key: dict[Cause, list[Record]], since_ns: int) -> None:
        self._by_key = by_key
        self._since_ns = since_ns
        self._incarnation: dict[str, int] = {}
        self._last: dict[tuple[str, str], int] = {}

    def find(self, cause: Cause) -> Record | None:
        """The message that `cause` names; None where the log lacks it."""
        topic, source, seq = cause
        candidates = self._by_key.get(cause)
        if not candidates:
            return None
        record = candidates[0] if len(candidates) == 1 else self._choose(candidates, cause)
        incarnation = _envelope(record).incarnation
        if self._incarnation.get(source) != incarnation:
            self._incarnation[source] = incarnation
            self._last = {key: last for key, last in self._last.items() if key[1] != source}
        self._last[topic, source] = seq
        return record

    def _choose(self, candidates: list[Record], cause: Cause) -> Record:
        topic, source, seq = cause
        current = self._incarnation.get(source)
        if current is None:
            fitting = [
                r for r in candidates if _envelope(r).sent_ns >= self._since_ns
            ] or candidates[-1:]
        else:
            least = current + (seq <= self._last.get((topic, source), -1))
            fitting = [r for r in candidates if _envelope(r).incarnation >= least] or candidates[
                -1:
            ]
        return min(fitting, key=lambda record: _envelope(record).incarnation)


def _inexact(reader: LogReader, records: list[Record], module_of: dict[str, str]) -> list[Job]:
    """Jobs for a log without envelopes: each instance takes in what others said, in the order of
    the log.
    """
    said: dict[str, list[tuple[int, Record]]] = defaultdict(list)
    order: list[tuple[str, Record]] = []
    for record in records:
        stub = reader.stub(record)
        said[stub.source].append((stub.seq, _bare(record)))
        order.append((stub.source, _bare(record)))
    found = []
    for source, module in module_of.items():
        steps = [
            Step(Kind.FEED, record)
            for other, record in order
            if (other == source) == _is_observed(record)
        ]
        job = Job(
            module, source, 0, [Step(Kind.START), *steps], _of_model(said[source]), exact=False
        )
        found.append(job)
    return found


def _is_observed(record: Record) -> bool:
    """Whether each instance takes in its own messages of this kind and nobody else's."""
    return record.topic is PRESENCE


def _envelope(record: Record) -> Envelope:
    if record.envelope is None:
        raise LogError("a message in the log has no envelope")
    return record.envelope


def _bare(record: Record) -> Record:
    return replace(record, envelope=None)
