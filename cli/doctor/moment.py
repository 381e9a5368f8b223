"""Finds what makes a system look ill that is not: it starts or ends, or its machine is too slow."""

from __future__ import annotations

from collections.abc import Sequence

from cogmap.cli.doctor.finding import Finding
from cogmap.cli.doctor.observed import Observed
from cogmap.cli.launch.plan import OBSERVER
from cogmap.cli.launch.watchdog import MAX_SHARE_SLOWED, REMEDY
from cogmap.runtime.notes import LATE_ANSWERS
from cogmap.services import registry

SYSTEM = "system"
STARTING_S = 60.0
"""A system may take so long to start, on a busy machine or in containers."""
ALL_BUSY = 0.95
"""The share of the processors' time beyond which whoever computes has to wait for the others."""


def passing(expected: Sequence[str], observed: Observed) -> Finding | None:
    """Tell that the system of the modules `expected` is starting, is ending, or is not there. None
    if it runs.
    """
    return ending(expected, observed) or nobody(expected, observed) or starting(expected, observed)


def ending(expected: Sequence[str], observed: Observed) -> Finding | None:
    """Tell that a system ends: whoever watches the drive has left, or several modules have; one
    alone has died.
    """
    left = {member.module for member in observed.left} & {*expected, OBSERVER}
    if OBSERVER not in left and len(left) < 2:
        return None

    names = ", ".join(sorted(left))
    return Finding(
        SYSTEM,
        f"it is ending: {names} left while I looked",
        "ask again when another runs; the summary of a drive has the reason of its end",
    )


def nobody(expected: Sequence[str], observed: Observed) -> Finding | None:
    """Tell that there is a router, and no module."""
    present = {member.module for member in observed.ready}
    if present & set(expected):
        return None
    return Finding(
        SYSTEM,
        "no module is on the bus: it has not started, or it has ended",
        "start one with `cogmap run`, wait for one that is starting, or name another agent with "
        "--agent",
    )


def starting(expected: Sequence[str], observed: Observed) -> Finding | None:
    """Tell that a system is starting: the body waits for others, and none has run for long."""
    newest = [reports[-1] for reports in observed.health.values()]
    bodies = {*registry.BODIES} & {*expected}
    has_begun = any(report.ready and report.module in bodies for report in newest)
    oldest_s = max((report.uptime_s for report in newest), default=0.0)
    if has_begun or oldest_s > STARTING_S:
        return None

    present = {member.module for member in observed.ready}
    waiting = [name for name in expected if name not in present]
    waiting += [report.instance for report in newest if not report.ready]
    if not waiting:
        return None

    names = ", ".join(dict.fromkeys(waiting))
    return Finding(
        SYSTEM,
        f"it is starting; not ready yet: {names}",
        f"ask again in a while; what is not ready after {STARTING_S:g} s says why in its log",
    )


def slow_machine(observed: Observed, late: Sequence[Finding]) -> list[Finding]:
    """Name the machine as the cause of the findings `late` and of old poses. Empty if it is not: a
    slow link, too, makes answers late and so poses old.
    """
    is_busy = bool(late) and observed.busy >= ALL_BUSY
    has_old_poses = observed.limited > MAX_SHARE_SLOWED * observed.commands
    if _has_late_answers(observed) and not is_busy:
        return []
    if not is_busy and not has_old_poses:
        return []

    reasons = []
    if is_busy:
        reasons.append(f"its processors were computing {observed.busy:.0%} of the time")
    if has_old_poses:
        share = observed.limited / observed.commands
        reasons.append(f"the robot drives slowly, as {share:.0%} of its poses are old")
    reasons += [f"{finding.about}: {finding.wrong}" for finding in late]
    return [Finding("machine", f"it is too slow for real time: {'; '.join(reasons)}", REMEDY)]


def _has_late_answers(observed: Observed) -> bool:
    """Return whether a process says that answers are late."""
    newest = [reports[-1] for reports in observed.health.values()]
    return any(note.startswith(LATE_ANSWERS) for report in newest for note in report.notes)
