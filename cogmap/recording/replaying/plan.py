"""What each recorded instance of a module received, in what order, and what it published."""

from __future__ import annotations

import enum
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from cogmap.errors import LogError
from cogmap.recording.storage import format as layout
from cogmap.recording.storage.reader import LogReader, Record
from cogmap.schemas.topics import PRESENCE, Scope


class Kind(enum.Enum):
    """What a module can be made to do."""

    FEED = enum.auto()
    START = enum.auto()
    TIMER = enum.auto()
    SNAPSHOT = enum.auto()


@dataclass(frozen=True, slots=True)
class Step:
    """One event in a module's life.

    It received the message in `record`, was started, had its timer called at `at_ns`, or loaded the
    graph that it follows, at `version`, before `at_ns`.
    """

    kind: Kind
    record: Record | None = None
    at_ns: int = 0
    version: int = 0


Expected = dict[str, dict[int, Record]]


@dataclass
class Job:
    """One incarnation of an instance: what happened to it, and what it published.

    `expected` has its messages by topic and number; `earlier` are those of its former incarnations,
    for a module that keeps a journal. `exact` is whether the order of its inputs is known: else it
    is that of the log, and the module receives of them what it handles. `missing` counts the inputs
    that the log lacks, by topic.
    """

    module: str
    instance: str
    number: int
    steps: list[Step] = field(default_factory=list)
    expected: Expected = field(default_factory=dict)
    earlier: list[Record] = field(default_factory=list)
    exact: bool = True
    missing: Counter[str] = field(default_factory=Counter)

    @property
    def input_bytes(self) -> int:
        """Return how much it receives."""
        return sum(step.record.size for step in self.steps if step.record is not None)


def modules_of(reader: LogReader, sources: Sequence[str], modules: Sequence[str]) -> dict[str, str]:
    """Return which of `modules` each of `sources` is an instance of, by source: as the recorder saw
    it or, otherwise, by its name, such as `codelets-2`.

    Raises LogError if one of `modules` has no instance.
    """
    members = [facts for name, facts in reader.metadata if name == layout.MEMBER]
    recorded = {facts.get("instance", ""): facts.get("module", "") for facts in members}
    found: dict[str, str] = {}
    for source in sources:
        named = (one for one in modules if source == one or source.startswith(f"{one}-"))
        module = recorded.get(source) or next(named, "")
        if module in modules:
            found[source] = module

    for module in modules:
        if module not in found.values():
            raise LogError(
                f"{reader.path} holds nothing that module {module} published: "
                f"there are {', '.join(sources)}"
            )
    return found


def of_model(records: Iterable[tuple[int, Record]]) -> Expected:
    """Return the records (number, record) whose bytes a replay must reproduce, by topic and
    number.
    """
    expected: Expected = defaultdict(dict)
    for seq, record in records:
        if record.topic.scope is Scope.MODEL:
            expected[record.topic.name][seq] = record
    return dict(expected)


def without_envelope(record: Record) -> Record:
    """Return a record as a job keeps it: its envelope is not needed to feed it."""
    return replace(record, envelope=None)


def inexact_jobs(reader: LogReader, records: Sequence[Record], modules: Sequence[str]) -> list[Job]:
    """Plan for a log without envelopes: each instance receives all, in the order of the log."""
    published: dict[str, list[tuple[int, Record]]] = defaultdict(list)
    order: list[tuple[str, Record]] = []
    for record in records:
        stub = reader.stub(record)
        bare = without_envelope(record)
        published[stub.source].append((stub.seq, bare))
        order.append((stub.source, bare))

    found = []
    for source, module in modules_of(reader, sorted(published), modules).items():
        steps = [Step(Kind.START)]
        for publisher, record in order:
            # An instance may have received all but its own; of presence, only what it observed.
            is_own = publisher == source
            if is_own == (record.topic is PRESENCE):
                steps.append(Step(Kind.FEED, record))
        expected = of_model(published[source])
        found.append(Job(module, source, 0, steps, expected, exact=False))
    return found
