"""The processes of a drive, by name: which there are, and what each holds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import psutil

from benchmarks.soak.trends import Sample

FORK_SERVER = "cogmap.cli.launch.forking.server"
PROGRAM = "cogmap.cli.main"
UNKNOWN = "other"


def name_of(words: Sequence[str]) -> str:
    """Return what a process is by the words of its command line: the instance of a module,
    `router`, `recorder`, `run`, `fork_server`, or `other`.
    """
    if FORK_SERVER in words:
        return "fork_server"
    if PROGRAM not in words:
        return UNKNOWN

    match list(words[words.index(PROGRAM) + 1 :]):
        case ["module", _, "--instance", instance, *_]:
            return instance
        case ["log", "record", *_]:
            return "recorder"
        case [verb, *_]:
            return verb
    return UNKNOWN


def sample(root_pids: Sequence[int], at_s: float) -> Iterator[tuple[tuple[str, int], Sample]]:
    """Yield name and id of each process below `root_pids`, these included, with what it holds at
    `at_s`. One that ends meanwhile is left out.
    """
    for root_pid in root_pids:
        try:
            root = psutil.Process(root_pid)
            family = [root, *root.children(recursive=True)]
        except psutil.NoSuchProcess:
            continue

        for process in family:
            try:
                with process.oneshot():
                    words = process.cmdline()
                    held = Sample(at_s, process.memory_info().rss, process.num_fds())
            except (psutil.NoSuchProcess, psutil.ZombieProcess):
                continue
            yield (name_of(words), process.pid), held
