"""What a bad link to the router loses, and what of that nobody is told."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import click

from benchmarks.benchmark import Setting
from benchmarks.partition.link import Link, Quality
from benchmarks.partition.members import Receiver, Source, working
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.bus.session import free_endpoint, open_router
from cogmap.cli.options import FiniteRange
from cogmap.cli.progress import bar
from cogmap.errors import CogmapError

THRESHOLDS = {"undelivered": at_most(0), "unreported": at_most(0)}
SECONDS = 20.0
AWAY_S = (1.0, 30.0, 120.0)
TIME_LIMIT_S = 600.0
POLL_S = 0.1
# Before and after the link is cut.
AROUND_S = 2.0
# A case that makes no progress for so long has ended: longer than a lost link takes to be noticed.
QUIET_S = 60.0
DELAY = Quality(delay_s=0.2)
STALLS = Quality(stall_share=0.05)
NARROW = Quality(rate_bytes_s=1e6)
OPTIONS = (
    click.Option(
        ["--away", "away_s"],
        type=FiniteRange(0, 3600),
        multiple=True,
        default=AWAY_S,
        show_default=True,
        metavar="SECONDS",
        help="How long the router is away; repeatable.",
    ),
    click.Option(
        ["--seconds"],
        type=FiniteRange(0, 3600),
        default=SECONDS,
        show_default=True,
        help="How long each of the other links is used.",
    ),
    click.Option(
        ["--seed"],
        type=int,
        default=1,
        show_default=True,
        help="Seed of the chunks that halt.",
    ),
    click.Option(
        ["--time-limit-s"],
        type=FiniteRange(1, 1e5),
        default=TIME_LIMIT_S,
        show_default=True,
        help="Of all together; a case that is not over by then counts what has not come.",
    ),
)


@dataclass(frozen=True)
class Case:
    """A link as `quality` says that is used for `lasts_s`, and cut for `away_s` in between."""

    name: str
    quality: Quality
    lasts_s: float
    away_s: float = 0.0


@dataclass(frozen=True)
class Count:
    """How many messages were published, did not come, and did so untold; over all receivers."""

    published: int
    undelivered: int
    unreported: int
    fetched_s: float


def measure(
    setting: Setting,
    *,
    away_s: tuple[float, ...] = AWAY_S,
    seconds: float = SECONDS,
    seed: int = 1,
    time_limit_s: float = TIME_LIMIT_S,
) -> Metrics:
    """Put a bad link between modules and the router, and count the never-drop messages that do not
    come, and those of them that no receiver reports.

    A module that publishes and one that receives have the link, another of each has none. It is
    200 ms late, halts at 5 % of its chunks, carries 1 MB/s, or is cut, as if the router were away.
    Takes about five minutes.
    """
    cases = [
        Case("delay", DELAY, seconds),
        Case("stalls", STALLS, seconds),
        Case("narrow", NARROW, seconds),
        *(Case(f"away_{each:g}s", Quality(), each + 2 * AROUND_S, each) for each in away_s),
    ]
    end_s = time.monotonic() + time_limit_s
    metrics: Metrics = {"undelivered": 0.0, "unreported": 0.0, "published": 0.0}
    with bar("bad links") as progress:
        for done, case in enumerate(cases):
            folder = setting.folder / case.name
            folder.mkdir()
            count = _count(case, folder, seed + done, end_s)
            progress((done + 1) / len(cases))
            metrics["undelivered"] += count.undelivered
            metrics["unreported"] += count.unreported
            metrics["published"] += count.published
            metrics[f"{case.name}_published"] = float(count.published)
            metrics[f"{case.name}_undelivered"] = float(count.undelivered)
            metrics[f"{case.name}_delivered_after_s"] = count.fetched_s
    return metrics


def _count(case: Case, folder: Path, seed: int, end_s: float) -> Count:
    """Let two publish and two receive in this case, and count."""
    with _link(case.quality, seed) as (endpoint, link):
        ends = {"near": endpoint, "far": link.endpoint}
        receivers = [Receiver(f"receiver-{name}", at) for name, at in ends.items()]
        sources = [Source(name, at, folder, len(receivers)) for name, at in ends.items()]
        shells = [each.shell for each in receivers] + [each.shell for each in sources]
        with working(*shells):
            _wait_until_all_meet(receivers, sources, end_s)
            if case.away_s:
                _wait(AROUND_S)
                link.cut()
                _wait(min(case.away_s, end_s - time.monotonic()))
                link.open()
                _wait(AROUND_S)
            else:
                _wait(min(case.lasts_s, end_s - time.monotonic()))

            for source in sources:
                source.is_publishing = False
            stopped_s = time.monotonic()
            lacking = _await_rest(receivers, sources, end_s)
            took_s = time.monotonic() - stopped_s

        reported = [receiver.reported for receiver in receivers]
        untold = [max(0, each - told) for each, told in zip(lacking, reported, strict=True)]
        published = sum(source.published.total() for source in sources)
        return Count(published, sum(lacking), sum(untold), took_s)


def _await_rest(receivers: list[Receiver], sources: list[Source], end_s: float) -> list[int]:
    """Wait until everything has come, or nothing does for QUIET_S. Returns what each lacks."""
    before: list[int] = []
    changed_s = time.monotonic()
    while True:
        lacking = [receiver.lacks(sources) for receiver in receivers]
        now_s = time.monotonic()
        if lacking != before:
            before = lacking
            changed_s = now_s
        if not any(lacking) or now_s > min(end_s, changed_s + QUIET_S):
            return lacking
        _wait(POLL_S)


def _wait_until_all_meet(receivers: list[Receiver], sources: list[Source], end_s: float) -> None:
    """Wait until each receiver has something of each source. Raises CogmapError if that fails."""
    names = {source.name for source in sources}
    while any(names != {name for name, _ in each.received} for each in receivers):
        if time.monotonic() > end_s:
            raise CogmapError("the time limit was over before the link was tried: allow more")
        _wait(POLL_S)


@contextmanager
def _link(quality: Quality, seed: int) -> Iterator[tuple[str, Link]]:
    """Yield the endpoint of a router, and a link to it."""
    endpoint = free_endpoint()
    router = open_router(endpoint)
    link = Link(int(endpoint.rpartition(":")[2]), quality, seed)
    try:
        yield endpoint, link
    finally:
        link.close()
        router.close()  # type: ignore[no-untyped-call]


def _wait(seconds: float) -> None:
    threading.Event().wait(max(0.0, seconds))
