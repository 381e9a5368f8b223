"""Many runs at once, a process a core; what comes of them does not depend on how many."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process
from typing import TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")
Progress = Callable[[float], None]


def each(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    processes: int,
    progress: Progress = lambda share: None,
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
    with ProcessPoolExecutor(min(processes, len(jobs)), get_context("spawn"), _tie) as pool:
        for result in pool.map(work, jobs):
            results.append(result)
            progress(len(results) / len(jobs))
    return results


def _tie() -> None:
    """Let a Ctrl-C end the parent alone, which ends its processes; end with it however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
    os._exit(1)
