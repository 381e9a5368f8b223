"""What is wrong with a running system, judged by what its processes say of themselves for a few
seconds.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise

from cli.doctor.finding import Finding
from cogmap.bus.discovery import Role, System
from cogmap.bus.interface import Member
from schemas import topics
from schemas.process import Health
from schemas.topics import About

TOLERANCE = 0.3
SLOWEST_HZ = 1.0
LONG_QUEUE = 10
FEWEST_REPORTS = 2


@dataclass
class Observed:
    """What was seen. `health` has each instance's reports in order; `clock_rate` is None where no
    clock was heard.
    """

    ready: set[Member] = field(default_factory=set)
    health: dict[str, list[Health]] = field(default_factory=dict)
    clock_rate: float | None = None


def examine(expected: Iterable[str], observed: Observed, system: System) -> list[Finding]:
    """All that is wrong with a system that should have the modules `expected`."""
    return [
        *absent(expected, observed),
        *silent(expected, observed),
        *_told(observed),
        *off_rate(observed, system),
        *truth_leaks(expected, system),
    ]


def absent(expected: Iterable[str], observed: Observed) -> Iterator[Finding]:
    """Modules of which no instance is on the bus."""
    there = {member.module for member in observed.ready}
    for name in expected:
        if name not in there:
            yield Finding(
                name,
                "no instance of it is on the bus: it is dead or was never started",
                _start(name, "see its log"),
            )


def silent(expected: Iterable[str], observed: Observed) -> Iterator[Finding]:
    """Instances that are on the bus and say nothing of themselves, others that are not ready."""
    modules = set(expected)
    for member in sorted(observed.ready):
        if member.module in modules and member.instance not in observed.health:
            yield Finding(
                member.instance,
                "it is on the bus but tells nothing",
                "see its log, it hangs or is stopped",
            )
    for instance, reports in sorted(observed.health.items()):
        if not reports[-1].ready:
            yield Finding(instance, "it is not ready", "start the modules that it waits for")


def _told(observed: Observed) -> Iterator[Finding]:
    """What the instances themselves complain of."""
    for instance, reports in sorted(observed.health.items()):
        last = reports[-1]
        for name, number in sorted(last.gaps.items()):
            if number:
                yield Finding(
                    instance,
                    f"{number} messages of {name} never reached it",
                    "see whether its queue is full, or the link",
                )
        for name, number in sorted(last.rejected.items()):
            if number:
                yield Finding(
                    instance,
                    f"it rejected {number} messages of {name}",
                    "its log names them: mend who publishes them",
                )
        queued = [report.queued for report in reports]
        if queued[-1] >= LONG_QUEUE and all(later > earlier for earlier, later in pairwise(queued)):
            yield Finding(
                instance,
                f"its queue grows, to {queued[-1]} messages",
                "give it a core of its own, or lower the rates of its inputs",
            )
        for note in last.notes:
            yield Finding(instance, note, "its log says more")


def off_rate(observed: Observed, system: System) -> Iterator[Finding]:
    """Topics whose rate is not the table's, as far as a few seconds of real time can tell."""
    if observed.clock_rate == 0:
        return
    measured = rates_hz(observed.health.values())
    for topic in topics.ALL:
        if (
            topic.rate_hz < SLOWEST_HZ
            or not system.doing(Role.PUBLISHES, topic)
            or topic.name not in measured
        ):
            continue
        expected_hz = topic.rate_hz * (observed.clock_rate or 1.0)
        if abs(measured[topic.name] - expected_hz) > TOLERANCE * expected_hz:
            yield Finding(
                topic.name,
                f"{measured[topic.name]:.1f} Hz, the table has {expected_hz:g} Hz",
                f"see with `cogmap topic delay {topic.name}` where the time goes",
            )


def rates_hz(reports_of: Iterable[list[Health]]) -> dict[str, float]:
    """The rate of each topic that somebody publishes, between the first and the last report of each
    instance.
    """
    rates: dict[str, float] = {}
    for reports in reports_of:
        first = reports[0]
        last = reports[-1]
        span_s = last.uptime_s - first.uptime_s
        if len(reports) < FEWEST_REPORTS or span_s <= 0:
            continue
        for name, number in last.emitted.items():
            rates[name] = rates.get(name, 0.0) + (number - first.emitted.get(name, 0)) / span_s
    return rates


def truth_leaks(expected: Iterable[str], system: System) -> Iterator[Finding]:
    """Modules that subscribe to the simulator's truth."""
    modules = set(expected)
    for topic in topics.ALL:
        if topic.about is About.TRUTH:
            for process in system.doing(Role.SUBSCRIBES, topic):
                if process.member is not None and process.member.module in modules:
                    yield Finding(
                        process.name,
                        f"it subscribes to {topic.name}",
                        "no module may see the truth",
                    )


def _start(name: str, else_: str) -> str:
    return f"start it with `cogmap module {name}`, or {else_}"
