"""The processes of a running system, one by one."""

from __future__ import annotations

import pytest

from cogmap.bus.discovery import Role, System, identity_key, read, use_key
from cogmap.bus.interface import Member
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.cli.graph import uses_of
from cogmap.cli.node import facts, health_of, process_named, text
from cogmap.errors import UsageError
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.schemas import topics
from cogmap.schemas.process import Health
from tests.support.system.networks import publish

AGENT = "agent"


@pytest.fixture
def system() -> System:
    """A simulation that publishes odometry and subscribes to commands."""
    uses = [(Role.PUBLISHES, topics.ODOMETRY), (Role.SUBSCRIBES, topics.MOTOR_COMMAND)]
    return read(
        AGENT,
        named=[identity_key(AGENT, "zid", Member("sim", "sim-2"))],
        used=[use_key(AGENT, "zid", role.value, topic.name) for role, topic in uses],
    )


def health(instance: str, number: int) -> Health:
    return Health(
        module="sim",
        instance=instance,
        source=instance,
        seq=number,
        ready=True,
        uptime_s=12.0,
        received={"motor/command": 3},
        emitted={"odometry": 40},
        rejected={},
        superseded={},
        gaps={},
        queued=0,
        busy=0.25,
        compute_p50_ms=1.0,
        compute_p99_ms=2.0,
        memory_mb=80.0,
        notes=["it is cold"],
    )


def test_a_process_is_shown_with_its_topics_and_how_it_fares(system: System) -> None:
    process = process_named("sim-2", system)

    shown = text(process, uses_of(system)[process], health("sim-2", 0))

    assert shown.splitlines() == [
        "sim-2 (sim)",
        "  publishes:",
        "    odometry: Odometry",
        "  subscribes:",
        "    motor/command: MotorCommand",
        "  ready, for 12 s; busy 25%, 80 MB, 0 messages wait",
        "  received 3 messages, emitted 40, rejected 0, lost 0",
        "  it is cold",
    ]


def test_programs_get_the_same(system: System) -> None:
    process = process_named("sim-2", system)

    found = facts(process, uses_of(system)[process], None)

    assert found["module"] == "sim"
    assert found["publishes"] == {"odometry": "Odometry"}
    assert found["answers"] == {}
    assert found["health"] is None


def test_a_process_that_does_not_run_is_named_with_the_nearest(system: System) -> None:
    with pytest.raises(UsageError, match="no process 'sim' runs: did you mean 'sim-2'"):
        process_named("sim", system)


def test_the_health_of_a_process_is_its_own(system: System) -> None:
    network = MemoryNetwork()
    inbox = Inbox()
    MemoryBus(network).subscribe(topics.HEALTH, inbox.put, lambda name, number: None)
    publish(MemoryBus(network), health("motor", 0), health("sim-2", 0))

    found = health_of(process_named("sim-2", system), inbox, 1.0)

    assert found is not None
    assert found.instance == "sim-2"
