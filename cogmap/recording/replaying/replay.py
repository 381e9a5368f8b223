"""Replays recorded inputs through modules, and compares what they publish with the log."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import Any

from cogmap.parallel import parallel_map
from cogmap.recording.log import recorded_config
from cogmap.recording.replaying.causes import jobs
from cogmap.recording.replaying.module_run import ModuleRun
from cogmap.recording.replaying.outcome import Outcome, Report
from cogmap.recording.replaying.plan import Job
from cogmap.recording.storage.reader import LogReader, Progress
from cogmap.runtime.module import Module

Sections = dict[str, dict[str, Any]]
Build = Callable[[str, Sections, str], Module]
# Input from which on several processes share a replay: they take time to start.
_MIN_PARALLEL_BYTES = 32 * 2**20


def replay_into(
    path: Path,
    modules: Sequence[str],
    build: Build,
    *,
    overrides: Sections | None = None,
    processes: int | None = None,
    progress: Progress | None = None,
) -> Report:
    """Feed every recorded instance of `modules` what it received, and compare what it publishes.

    `build` makes a module from its name, the recorded configuration with `overrides`, and an
    instance's name. `processes` None takes several if the log is long. Raises LogError, also
    if the log lacks deltas of a graph that a module follows, and ConfigError.
    """
    began_s = time.perf_counter()
    reader = LogReader(path)
    sections = {name: dict(section) for name, section in recorded_config(reader).items()}
    for name, section in (overrides or {}).items():
        sections.setdefault(name, {}).update(section)

    todo = jobs(reader, list(dict.fromkeys(modules)))
    work = partial(run_job, path=path, build=build, sections=sections)
    if processes is None:
        input_bytes = sum(job.input_bytes for job in todo)
        processes = (os.cpu_count() or 1) if input_bytes >= _MIN_PARALLEL_BYTES else 1
    outcomes = _run_all(todo, work, processes, progress)

    wall_s = time.perf_counter() - began_s
    log_s = reader.span_s
    return Report(
        path=str(path),
        log_s=log_s,
        wall_s=wall_s,
        speed=log_s / wall_s,
        same=all(outcome.is_same for outcome in outcomes),
        first=next((outcome.first for outcome in outcomes if outcome.first), ""),
        outcomes=outcomes,
    )


def run_job(job: Job, path: Path, build: Build, sections: Sections) -> Outcome:
    """Replay one job. Raises ConfigError, LogError."""
    began_s = time.perf_counter()
    module = build(job.module, sections, job.instance)
    outcome = ModuleRun(LogReader(path), job, module).replay()
    outcome.busy_s = time.perf_counter() - began_s
    return outcome


def _run_all(
    todo: list[Job],
    work: Callable[[Job], Outcome],
    processes: int,
    progress: Progress | None,
) -> list[Outcome]:
    """Return every job's outcome, in the order of `todo`; the longest begin first."""
    order = sorted(range(len(todo)), key=lambda index: -_cost(todo[index]))
    longest_first = [todo[index] for index in order]
    done = list(accumulate(_cost(job) for job in longest_first))

    def report(share: float) -> None:
        finished = round(share * len(done))
        if progress is not None and finished > 0:
            progress(done[finished - 1] / done[-1])

    outcomes = parallel_map(work, longest_first, processes, report)
    by_index = dict(zip(order, outcomes, strict=True))
    return [by_index[index] for index in range(len(todo))]


def _cost(job: Job) -> int:
    """Return how long a job takes, beside others."""
    return 1 + job.input_bytes + len(job.steps)
