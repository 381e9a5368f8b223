"""Independent jobs spread over processes; the results do not depend on how many there are."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from typing import TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")
POLL_S = 0.5
Progress = Callable[[float], None]


def parallel_map(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    processes: int,
    progress: Progress = lambda share: None,
) -> list[Result]:
    """Return `work` of every job, in the order of `jobs`; `progress` is called with the share done
    as each of them ends.

    `work` and the jobs are pickled, arrays of any size too. One process, or one job, runs in the
    calling process.
    """
    # As long to import as a command is to start that has nothing to spread.
    from joblib import Parallel, delayed

    count = max(1, min(processes, len(jobs)))
    pool = Parallel(
        n_jobs=count,
        backend="loky",
        max_nbytes=None,
        initializer=_end_with,
        initargs=(os.getpid(),),
        return_as="generator_unordered",
    )
    results: dict[int, Result] = {}

    for number, result in pool(delayed(_numbered)(work, *job) for job in enumerate(jobs)):
        results[number] = result
        progress(len(results) / len(jobs))

    return [results[number] for number in range(len(jobs))]


def _numbered(work: Callable[[Job], Result], number: int, job: Job) -> tuple[int, Result]:
    """Return the number of a job with its result: the shortest job ends first."""
    return number, work(job)


def end_workers() -> None:
    """End the processes that wait for another `parallel_map`; by themselves they do in 5 minutes.

    A process that a pool has started cannot exit before.
    """
    from joblib.externals.loky import get_reusable_executor

    get_reusable_executor(reuse=True).shutdown(wait=True)


def exit_with(parent: int) -> None:
    """Exit this process when `parent` exits, even amid a job."""
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    """Leave Ctrl-C to the parent process, and exit when it exits."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    exit_with(parent)


def _watch(parent: int) -> None:
    """Exit when `parent` has ended: this process then has another parent."""
    while os.getppid() == parent:
        time.sleep(POLL_S)

    os._exit(1)
