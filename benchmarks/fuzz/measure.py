"""The metrics of fuzz: crashes, hangs, memory that is not given back, files over their bound."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from queue import Empty, Queue

import click

from benchmarks.benchmark import PROCESSES, Setting
from benchmarks.fuzz import files, messages
from benchmarks.fuzz.watch import Findings
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.cli.progress import bar
from cogmap.parallel import Progress, exit_with

THRESHOLDS = {
    "crashes": at_most(0),
    "hangs": at_most(0),
    "memory_growth_mb": at_most(20),
    "files_over_bound": at_most(0),
}
OPTIONS = [
    click.Option(
        ["--messages", "count"],
        type=click.IntRange(0),
        default=1_000_000,
        show_default=True,
        help="So many mutated messages.",
    ),
    click.Option(
        ["--files", "file_count"],
        type=click.IntRange(0),
        default=20_000,
        show_default=True,
        help="So many mutated files, formats in turn.",
    ),
    click.Option(["--seed"], type=int, default=1, show_default=True, help="Seed of all mutations."),
    click.Option(
        ["--time-limit-s"],
        type=click.FloatRange(1.0),
        default=3600.0,
        show_default=True,
        help="No mutation begins later.",
    ),
    PROCESSES,
]
SHOWN = 20
POLL_S = 0.5


def measure(
    setting: Setting,
    count: int = 1_000_000,
    file_count: int = 20_000,
    seed: int = 1,
    time_limit_s: float = 3600.0,
) -> Metrics:
    """Put mutated messages before every module, and mutated files before every reader.

    Messages of every topic, changed bit by bit and as MessagePack, arrive on the in-memory bus at
    all modules of a drive but the town. Files of every format, and some that were made to fill the
    memory, go through the readers. Whatever is raised but an error of ours is a crash, as is a
    process that ends; `faults` are those that the shell around a module caught and counted. More
    than a second of computing for one is a hang, more than 512 MiB for a file is over its bound.
    The memory that is kept counts from the end of the warm-up. Takes half an hour on two cores.
    """
    until_s = time.monotonic() + time_limit_s
    processes = setting.processes
    context = multiprocessing.get_context("spawn")
    with (
        context.Manager() as manager,
        ProcessPoolExecutor(processes, context, exit_with, (os.getpid(),)) as pool,
        bar("fuzzing") as progress,
    ):
        tried: Queue[int] = manager.Queue()
        pending: list[tuple[str, Future[Findings]]] = []
        for number, share in enumerate(shares(file_count, processes)):
            folder = setting.folder / f"files-{number}"
            folder.mkdir()
            own = f"{seed}/{number}"
            job = pool.submit(files.campaign, own, share, until_s, tried.put, folder)
            pending.append(("files", job))
        for number, share in enumerate(shares(count, processes)):
            own = f"{seed}/{number}"
            job = pool.submit(messages.campaign, own, share, until_s, tried.put)
            pending.append(("messages", job))

        _show(progress, tried, count + file_count, [job for _, job in pending])
        found, ended = gathered(pending, setting.announce)

    return metrics(found, ended)


def _show(progress: Progress, tried: Queue[int], total: int, jobs: list[Future[Findings]]) -> None:
    """Show how many of `total` mutations were tried, until all jobs have ended."""
    done = 0
    while not all(job.done() for job in jobs):
        try:
            done += tried.get(timeout=POLL_S)
        except Empty:
            continue
        progress(done / total)


def gathered(
    pending: list[tuple[str, Future[Findings]]], announce: Callable[[str], None]
) -> tuple[dict[str, Findings], int]:
    """Return what was found, of files and of messages, and how many processes ended."""
    found = {"files": Findings(), "messages": Findings()}
    ended = 0
    for kind, future in pending:
        try:
            findings = future.result()
        except BrokenProcessPool:
            ended += 1
            continue
        found[kind].add(findings)
        announce(f"{kind}: {findings.tried} tried, {findings.refused} refused")

    for kind, findings in found.items():
        for what in ("crashes", "faults", "hangs", "over_bound"):
            for case, times in getattr(findings, what).most_common(SHOWN):
                announce(f"{kind}, {what}: {times} x {case}")
    return found, ended


def metrics(found: dict[str, Findings], ended: int) -> Metrics:
    """Return the metrics of what was found, with so many processes that ended."""
    everything = list(found.values())
    crashes = sum(sum(each.crashes.values()) for each in everything)
    return {
        "crashes": crashes + ended,
        "hangs": sum(sum(each.hangs.values()) for each in everything),
        "memory_growth_mb": max(each.growth_mb for each in everything),
        "files_over_bound": sum(found["files"].over_bound.values()),
        "faults": sum(found["messages"].faults.values()),
        "messages": found["messages"].tried,
        "messages_handled": found["messages"].handled,
        "messages_refused": found["messages"].refused,
        "files": found["files"].tried,
        "files_refused": found["files"].refused,
        "slowest_s": max(each.slowest_s for each in everything),
        "largest_file_mb": found["files"].largest_mb,
    }


def shares(count: int, processes: int) -> list[int]:
    """Divide a number among processes."""
    return [count // processes + (number < count % processes) for number in range(processes)]
