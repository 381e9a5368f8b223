"""Many runs at once, a process a core; what comes of them does not depend on how many."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")
Progress = Callable[[float], None]


def each(
    work: Callable[[Job], Result], jobs: Sequence[Job], processes: int, progress: Progress = lambda share: None
) -> list[Result]:
    """`work` of every job, in the order of the jobs. `progress` is told the share done.

    `work` and the jobs travel to the processes, so `work` is a function of a module.
    """
    results = []
    if processes == 1 or len(jobs) < 2:
        for job in jobs:
            results.append(work(job))
            progress(len(results) / len(jobs))
        return results
    with ProcessPoolExecutor(min(processes, len(jobs)), mp_context=get_context("spawn")) as pool:
        for result in pool.map(work, jobs):
            results.append(result)
            progress(len(results) / len(jobs))
    return results
