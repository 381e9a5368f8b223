"""Replays recorded inputs through modules in lockstep, and holds what they say against what the log
says.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import msgspec

from cogmap.bus.codec import encode
from cogmap.errors import LogError, MessageError
from cogmap.recording.replaying import compare
from cogmap.recording.replaying.logged_graph import LoggedGraph
from cogmap.recording.replaying.plan import Job, Kind, Step, jobs, recorded_sections
from cogmap.recording.storage.reader import LogReader, Progress
from cogmap.runtime.module import Module
from schemas import topics
from schemas.base import Message
from schemas.graph import Delta

Sections = dict[str, dict[str, Any]]
Build = Callable[[str, Sections, str], Module]
SIDES = ("the log", "the replay")
_WORTH_PROCESSES_BYTES = 32 * 2**20


class Outcome(msgspec.Struct, kw_only=True):
    """How one incarnation of an instance fared.

    `fed` inputs, `same` and `different` outputs; `unsaid` are in the log but were not said,
    `unrecorded` the other way about. `missing` inputs are not in the log, by topic. `first` is the
    first difference in words.
    """

    module: str
    instance: str
    incarnation: int
    fed: int = 0
    same: int = 0
    different: int = 0
    unsaid: int = 0
    unrecorded: int = 0
    missing: dict[str, int] = {}
    first: str = ""
    notes: list[str] = []
    busy_s: float = 0.0


class Report(msgspec.Struct, kw_only=True):
    """What a replay found. `speed` is the time that the log covers over the time that the replay
    took.
    """

    path: str
    log_s: float
    wall_s: float
    speed: float
    same: bool
    first: str
    outcomes: list[Outcome]


def replay_into(
    path: Path,
    modules: Sequence[str],
    build: Build,
    *,
    overrides: Sections | None = None,
    processes: int | None = None,
    progress: Progress | None = None,
) -> Report:
    """Feed every recorded instance of `modules` what it took in, and compare what it says with the
    log.

    `build` makes a module from its name, the recorded configuration with `overrides`, and an
    instance's name; to run in several `processes` (None: as is worth it) it must be importable.
    Raises LogError, ConfigError.
    """
    began_s = time.perf_counter()
    reader = LogReader(path)
    sections = _merged(recorded_sections(reader), overrides or {})
    todo = jobs(reader, list(dict.fromkeys(modules)))
    outcomes = _run_all(path, todo, (build, sections), _processes(todo, processes), progress)
    wall_s = time.perf_counter() - began_s
    first = next((outcome.first for outcome in outcomes if outcome.first), "")
    log_s = reader.span_s
    return Report(
        path=str(path),
        log_s=log_s,
        wall_s=wall_s,
        speed=log_s / wall_s,
        same=not any(outcome.different or outcome.unsaid or outcome.first for outcome in outcomes),
        first=first,
        outcomes=outcomes,
    )


def _merged(sections: Sections, overrides: Sections) -> Sections:
    names = [*sections, *(name for name in overrides if name not in sections)]
    return {name: {**sections.get(name, {}), **overrides.get(name, {})} for name in names}


def _processes(todo: list[Job], asked: int | None) -> int:
    if asked is None:
        asked = os.cpu_count() or 1
        if sum(job.input_bytes for job in todo) < _WORTH_PROCESSES_BYTES:
            asked = 1
    return min(asked, len(todo))


def _run_all(
    path: Path,
    todo: list[Job],
    how: tuple[Build, Sections],
    processes: int,
    progress: Progress | None,
) -> list[Outcome]:
    """Every job's outcome, in the order of `todo`; the longest begin first."""
    total = sum(job.input_bytes + len(job.steps) for job in todo) or 1
    done = 0.0
    outcomes: list[Outcome | None] = [None] * len(todo)
    for index, outcome in _finished(path, todo, how, processes):
        outcomes[index] = outcome
        done += todo[index].input_bytes + len(todo[index].steps)
        if progress is not None:
            progress(done / total)
    return [outcome for outcome in outcomes if outcome is not None]


def _finished(
    path: Path, todo: list[Job], how: tuple[Build, Sections], processes: int
) -> Iterable[tuple[int, Outcome]]:
    order = sorted(range(len(todo)), key=lambda index: -todo[index].input_bytes)
    if processes <= 1:
        for index in range(len(todo)):
            yield index, run_job(path, todo[index], *how)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=context) as pool:
        running = {pool.submit(run_job, path, todo[index], *how): index for index in order}
        for future in as_completed(running):
            yield running[future], future.result()


def run_job(path: Path, job: Job, build: Build, sections: Sections) -> Outcome:
    """Replay one job. Raises ConfigError, LogError."""
    began_s = time.perf_counter()
    run = _Run(LogReader(path), job, build(job.module, sections, job.instance))
    outcome = run.through()
    outcome.busy_s = time.perf_counter() - began_s
    return outcome


class _Run:
    """One module on its way through a job."""

    def __init__(self, reader: LogReader, job: Job, module: Module) -> None:
        self._reader = reader
        self._job = job
        self._module = module
        self._logged_graph = LoggedGraph(reader)
        self._untimed = 0
        self._said: dict[str, set[int]] = {name: set() for name in job.expected}
        self.outcome = Outcome(
            module=job.module,
            instance=job.instance,
            incarnation=job.number,
            missing=dict(job.missing),
        )

    def through(self) -> Outcome:
        """Do every step, compare every output, and count what was not said."""
        self._restore()
        for step in self._job.steps:
            for message in self._do(step):
                self._hold(message)
        self._count_unsaid()
        self._remark()
        return self.outcome

    def _restore(self) -> None:
        journal = self._module.journal
        past = [record for record in self._job.earlier if record.topic is journal]
        if past and self._module.restore is not None:
            self._module.restore(self._reader.message(record) for record in past)

    def _do(self, step: Step) -> list[Message]:
        try:
            return self._answer(step)
        except LogError:
            raise
        except (
            Exception
        ) as error:  # when it was recorded, it took this in: whatever is raised is a difference
            name = step.record.topic.name if step.record is not None else step.kind.name.lower()
            if self._job.exact:
                self._differ(
                    f"{name}: {self._job.instance} refuses what it took in: {type(error).__name__}: {error}"
                )
            return []

    def _answer(self, step: Step) -> list[Message]:
        module = self._module
        if step.record is not None:
            if step.record.topic not in module.handlers:
                if self._job.exact:
                    raise MessageError("it does not take in this topic")
                return []
            self.outcome.fed += 1
            return self._feed(self._reader.message(step.record))
        if step.kind is Kind.SNAPSHOT:
            return self._load(step)
        if step.kind is Kind.START:
            return module.stamp(module.start()) if module.start is not None else []
        if len(module.timers) != 1:
            self._untimed += 1
            return []
        return module.stamp(module.timers[0].handler(step.at_ns))

    def _feed(self, message: Message) -> list[Message]:
        """Let the module receive a message. Raises LogError where its graph lacks earlier deltas."""
        said = self._module.feed(message)
        graph = self._module.graph
        if graph is not None and isinstance(message, Delta) and graph.version < message.version:
            raise LogError(
                f"{self._reader.path}: {self._job.instance} follows the graph, and the log lacks "
                f"the deltas {graph.version + 1} to {message.version - 1}: "
                f"record from the start of the workspace"
            )
        return said

    def _load(self, step: Step) -> list[Message]:
        if self._module.graph is None:
            raise MessageError("it does not follow the graph")
        self._module.graph.load(self._logged_graph.at(step.version, step.at_ns))
        return self._module.loaded()

    def _hold(self, message: Message) -> None:
        """Hold what was said against the message of that number in the log."""
        topic = topics.of(message)
        expected = self._job.expected.get(topic.name)
        if expected is None:
            return
        self._said[topic.name].add(message.seq)
        record = expected.get(message.seq)
        if record is None:
            self.outcome.unrecorded += message.seq < max(expected)
            return
        payload = encode(message)
        recorded = self._reader.payload(record)
        if payload == recorded:
            self.outcome.same += 1
        else:
            self.outcome.different += 1
            if not self.outcome.first:
                self._differ(compare.in_words(topic, recorded, payload, SIDES))

    def _count_unsaid(self) -> None:
        said = self._said
        expected = self._job.expected
        lacking = [
            record
            for name in expected
            for seq, record in expected[name].items()
            if seq not in said[name]
        ]
        self.outcome.unsaid = len(lacking)
        if lacking and not self.outcome.first:
            record = min(
                lacking, key=lambda record: (record.log_time_ns, record.channel, record.sequence)
            )
            name = compare.which(record.topic, self._reader.message(record))
            self._differ(f"{name} is in {SIDES[0]} and not said in {SIDES[1]}")

    def _remark(self) -> None:
        """Say what else is to be known before the outcome is judged."""
        outcome = self.outcome
        notes = self.outcome.notes
        if outcome.missing:
            lacking = ", ".join(
                f"{number} of {name}" for name, number in sorted(outcome.missing.items())
            )
            notes.append(f"inputs that the log lacks: {lacking}")
        if outcome.unrecorded:
            notes.append(f"{outcome.unrecorded} outputs that the log lacks")
        if not self._job.exact:
            notes.append("the log has no envelopes: inputs were fed in the order of the log")
        if self._untimed:
            notes.append(
                f"{self._untimed} calls of a timer left out: the module has {len(self._module.timers)} timers"
            )
        late = sorted(
            name
            for name, expected in self._job.expected.items()
            if self._job.exact and min(expected) > 0
        )
        if late:
            notes.append(
                f"the log begins after the module did: its first of {', '.join(late)} is not number 0"
            )

    def _differ(self, sentence: str) -> None:
        self.outcome.first = self.outcome.first or sentence
