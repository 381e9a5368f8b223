"""How fast the system is, and how its processes fare, as the page shows it. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from statistics import median

import numpy as np

from cogmap.cli.dashboard import parts, workers
from cogmap.cli.dashboard.received import Arrived, Received
from cogmap.schemas.process import Health

SILENT_S = 5.0
"""A process that has said nothing for so long is silent: each reports its health every second."""


def system_part(received: Received) -> parts.SystemPart:
    """Return latency by stage, of the last commands, and the health of each process."""
    system = parts.SystemPart()
    if received.commands:
        cycles_ms = [_cycle_ms(each) for each in received.commands]
        system.cycle_p50_ms = round(median(cycles_ms), 1)
        system.cycle_max_ms = round(max(cycles_ms), 1)
        system.stages = _stages(received.commands)

    newest_ns = max((each.received_ns for each in received.newest.values()), default=0)
    for _, arrived in sorted(received.health.items()):
        silent_ns = newest_ns - arrived.received_ns
        system.processes.append(_process(arrived, silent_ns > SILENT_S * 1e9))
    return system


def _cycle_ms(command: Arrived) -> float:
    assert command.envelope is not None
    return (command.received_ns - command.envelope.born_ns) / 1e6


def _stages(commands: Iterable[Arrived]) -> list[parts.StageTime]:
    """Return the median time of each module on the way to these commands, in order."""
    times_ns: dict[str, list[tuple[int, int]]] = {}
    for command in commands:
        assert command.envelope is not None
        for module, compute_ns, rest_ns in command.envelope.stages:
            times_ns.setdefault(module, []).append((compute_ns, rest_ns))

    found = []
    for module, pairs in times_ns.items():
        compute_ms, rest_ms = (np.median(np.array(pairs), axis=0) / 1e6).tolist()
        stage = parts.StageTime(
            module=module, compute_ms=round(compute_ms, 1), rest_ms=round(rest_ms, 1)
        )
        found.append(stage)
    return found


def _process(arrived: Arrived, is_silent: bool) -> parts.ProcessHealth:
    health = arrived.message
    assert isinstance(health, Health)
    return parts.ProcessHealth(
        instance=health.instance,
        is_worker=health.module == workers.MODULE,
        busy=health.busy,
        compute_p50_ms=health.compute_p50_ms,
        memory_mb=health.memory_mb,
        queued=health.queued,
        lost=sum(health.gaps.values()),
        rejected=sum(health.rejected.values()),
        notes=health.notes,
        is_silent=is_silent,
    )
