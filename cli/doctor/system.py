"""Finds problems of a running system, by what its processes report in a few seconds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise

from cogmap.bus.discovery import Role, System
from cogmap.cli.doctor import moment
from cogmap.cli.doctor.finding import Finding
from cogmap.cli.doctor.observed import Observed
from cogmap.runtime.notes import wrong_and_remedy
from cogmap.schemas import topics
from cogmap.schemas.process import Health
from cogmap.schemas.topics import Scope
from cogmap.services import registry

RATE_TOLERANCE = 0.3
MIN_MEASURED_HZ = 1.0
LONG_QUEUE = 10
MIN_REPORTS = 2
FAR_MORE = 2.0
FAR_MORE_HZ = 20.0
"""So many times as many, and so many more a second, no process explains that reports now and then.
"""


def examine(expected: Iterable[str], observed: Observed, system: System) -> list[Finding]:
    """Collect all findings about a system that should have the modules `expected`. The rates of a
    recording are its own.

    Where it is starting or ending, that is all there is to say; where the machine is too slow, that
    is the cause of what else is late.
    """
    modules = list(expected)
    passing = moment.passing(modules, observed)
    if passing is not None:
        return [passing]

    rates = [] if registry.PLAYER in modules else wrong_rates(observed, system)
    refused = list(rejections(observed))
    too_old = [finding for name, finding in refused if name == topics.MOTOR_COMMAND.name]
    still = standing(modules, observed)
    late = [*silent(modules, observed), *growing_queues(observed), *rates, *too_old, *still]
    return [
        *absent(modules, observed),
        *not_ready(observed),
        *complaints(observed),
        *(finding for _, finding in refused if finding not in too_old),
        *(moment.slow_machine(observed, late) or late),
        *contradictions(observed, system),
        *unknown_publishers(observed),
        *truth_leaks(modules, system),
    ]


def absent(expected: Iterable[str], observed: Observed) -> Iterator[Finding]:
    """Yield a finding for each module of which no instance is on the bus."""
    present = {member.module for member in observed.ready}
    for name in expected:
        if name not in present:
            yield Finding(
                name,
                "no instance of it is on the bus: it has died or was never started",
                f"start it with `cogmap module {name}`, or see its log",
            )


def silent(expected: Iterable[str], observed: Observed) -> Iterator[Finding]:
    """Yield a finding for each instance of the modules that is on the bus but reports nothing."""
    modules = set(expected)
    for member in sorted(observed.ready):
        if member.module in modules and member.instance not in observed.health:
            yield Finding(
                member.instance,
                "it is on the bus but reports nothing",
                "see its log: it hangs or is stopped",
            )


def not_ready(observed: Observed) -> Iterator[Finding]:
    """Yield a finding for each instance that reports that it is not ready."""
    for instance, reports in sorted(observed.health.items()):
        if not reports[-1].ready:
            yield Finding(instance, "it is not ready", "start the modules that it waits for")


def complaints(observed: Observed) -> Iterator[Finding]:
    """Yield the losses and notes that the instances report."""
    for instance, reports in sorted(observed.health.items()):
        last = reports[-1]
        for name, number in sorted(last.gaps.items()):
            if number:
                yield Finding(
                    instance,
                    f"{number} messages of {name} never reached it",
                    "see whether its queue is full, or the link",
                )

        for note in last.notes:
            wrong, remedy = wrong_and_remedy(note)
            yield Finding(instance, wrong, remedy or "see its log")


def rejections(observed: Observed) -> Iterator[tuple[str, Finding]]:
    """Yield a finding for each topic of which an instance rejected messages, with its name."""
    for instance, reports in sorted(observed.health.items()):
        for name, number in sorted(reports[-1].rejected.items()):
            if number:
                wrong = f"it rejected {number} messages of {name}"
                yield name, Finding(instance, wrong, "its log names them: correct their publisher")


def standing(expected: Iterable[str], observed: Observed) -> Iterator[Finding]:
    """Yield a finding if the robot was commanded nothing, and nobody had asked that time stands."""
    if "motor" in expected and not observed.commands and not observed.is_paused:
        yield Finding(
            "motor",
            "it commanded nothing while I looked",
            "see what others refuse or wait for: their findings here, their logs",
        )


def growing_queues(observed: Observed) -> Iterator[Finding]:
    """Yield a finding for each instance that has ever more messages to handle."""
    for instance, reports in sorted(observed.health.items()):
        queued = [report.queued for report in reports]
        is_growing = all(later > earlier for earlier, later in pairwise(queued))
        if is_growing and queued[-1] >= LONG_QUEUE:
            yield Finding(
                instance,
                f"its queue grows, to {queued[-1]} messages",
                "give it a core of its own, or lower the rates of its inputs",
            )


def wrong_rates(observed: Observed, system: System) -> Iterator[Finding]:
    """Yield topics whose rate is not the table's, as far as a few seconds of real time can show."""
    clock_rate = 1.0 if observed.clock_rate is None else observed.clock_rate
    if clock_rate == 0:
        return

    measured = rates_hz(observed.health.values())
    for topic in topics.ALL:
        is_published = topic.name in measured and system.doing(Role.PUBLISHES, topic)
        if not is_published or topic.rate_hz < MIN_MEASURED_HZ:
            continue

        expected_hz = topic.rate_hz * clock_rate
        if abs(measured[topic.name] - expected_hz) > RATE_TOLERANCE * expected_hz:
            yield Finding(
                topic.name,
                f"{measured[topic.name]:.1f} Hz, the table has {expected_hz:.3g} Hz",
                f"see with `cogmap topic delay {topic.name}` where the time goes",
            )


def rates_hz(reports_of: Iterable[list[Health]]) -> dict[str, float]:
    """Compute the rate of each published topic, between each instance's first and last report."""
    rates: dict[str, float] = {}
    for reports in reports_of:
        for name, rate_hz in _rates_hz(reports, lambda report: report.emitted).items():
            rates[name] = rates.get(name, 0.0) + rate_hz
    return rates


def _rates_hz(
    reports: list[Health], counts: Callable[[Health], dict[str, int]]
) -> dict[str, float]:
    """Compute how fast the counts of one instance grow, by topic, between its first and last
    report.
    """
    first = reports[0]
    last = reports[-1]
    span_s = last.uptime_s - first.uptime_s
    if len(reports) < MIN_REPORTS or span_s <= 0:
        return {}
    before = counts(first)
    return {name: (number - before.get(name, 0)) / span_s for name, number in counts(last).items()}


def unknown_publishers(observed: Observed) -> Iterator[Finding]:
    """Yield a finding for each topic of which an instance receives far more than all processes
    publish that report their health.
    """
    published = rates_hz(observed.health.values())
    received: dict[str, float] = {}
    for reports in observed.health.values():
        for name, rate_hz in _rates_hz(reports, lambda report: report.received).items():
            received[name] = max(rate_hz, received.get(name, 0.0))

    for name, rate_hz in sorted(received.items()):
        known_hz = published.get(name, 0.0)
        if rate_hz > FAR_MORE * known_hz + FAR_MORE_HZ:
            yield Finding(
                name,
                f"{rate_hz:.0f} Hz are received, and those who report their health publish "
                f"{known_hz:.1f} Hz",
                "find out who else publishes it, and end that",
            )


def contradictions(observed: Observed, system: System) -> Iterator[Finding]:
    """Yield a finding for each topic that several processes publish and one alone may.

    Those that report to have published none of it do not count: where the simulation senses
    percepts, sensory memory and EPAM stand idle.
    """
    for topic in topics.ALL:
        publishing = []
        for process in system.doing(Role.PUBLISHES, topic):
            reports = observed.health.get(process.name)
            if reports is None or reports[-1].emitted.get(topic.name):
                publishing.append(process)

        if topic.shared or len(publishing) < 2:
            continue
        names = ", ".join(process.name for process in publishing)
        yield Finding(
            topic.name,
            f"{names} publish it, and contradict each other",
            "end all but one of them",
        )


def truth_leaks(expected: Iterable[str], system: System) -> Iterator[Finding]:
    """Yield a finding for each module that subscribes to the simulator's ground truth."""
    modules = set(expected)
    for topic in topics.ALL:
        if topic.scope is not Scope.TRUTH:
            continue
        for process in system.doing(Role.SUBSCRIBES, topic):
            if process.member is not None and process.member.module in modules:
                yield Finding(
                    process.name,
                    f"it subscribes to {topic.name}",
                    "no module may see the ground truth",
                )
