"""What a shell reports of its module once a second, over either bus."""

from __future__ import annotations

from cogmap.bus.codec import Cause
from cogmap.bus.interface import Member
from cogmap.runtime.delivery.publisher import MAX_CAUSES
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.sensing import MotorCommand, Odometry
from cogmap.testing import odometry
from tests.support.system.networks import Network, Peer, meet, next_health, publish, spin_until


def command(odometry: Odometry) -> MotorCommand:
    return MotorCommand(left_wheel_rad_s=1.0, right_wheel_rad_s=1.0)


def observed(network: Network, module: Module) -> tuple[Shell, Peer]:
    """An open shell around `module`, and a peer that receives its health and publishes odometry."""
    shell = Shell(module, network.join())
    peer = Peer(network.join(), topics.HEALTH)
    peer.bus.declare(topics.ODOMETRY)
    shell.open()
    meet(peer.bus, shell.bus)
    meet(shell.bus, peer.bus)
    return shell, peer


def test_health_carries_the_causes_of_a_module_that_publishes_nothing(network: Network) -> None:
    module = Module("codelets", "codelets-2").on(
        topics.ODOMETRY, lambda odometry: None, emits=[topics.MOTOR_COMMAND]
    )
    shell, peer = observed(network, module)
    count = MAX_CAUSES + 1

    publish(peer.bus, *map(odometry, range(count)))
    spin_until(lambda: shell.intake.received["odometry"] == count, shell)
    causes: list[Cause] = []
    while not causes:
        spin_until(lambda: len(peer.inbox) > 0, shell)
        (arrival,) = peer.take(1)
        assert arrival.envelope is not None
        causes = arrival.envelope.causes

    assert causes == [("odometry", "sim", seq) for seq in range(count)]
    shell.close()


def test_health_reports_what_was_received_and_rejected(network: Network) -> None:
    module = Module("action", "action-1").on(topics.ODOMETRY, command, emits=[topics.MOTOR_COMMAND])
    shell, peer = observed(network, module)

    publish(peer.bus, odometry(0), odometry(0), odometry(2))
    spin_until(lambda: shell.intake.received["odometry"] == 2, shell)
    health = next_health(peer, shell)

    assert (health.module, health.instance, health.source) == ("action", "action-1", "action-1")
    assert health.ready is True
    assert health.received == {"odometry": 2}
    assert health.rejected == {"odometry": 1}
    assert health.gaps == {"odometry": 1}
    assert health.emitted == {"motor/command": 2}
    assert health.memory_mb > 1
    shell.close()


def test_a_module_that_waits_for_others_is_not_ready(network: Network) -> None:
    module = Module("sim").on_start(lambda: None, requires={"action": 1})
    shell, peer = observed(network, module)

    health = next_health(peer, shell)

    assert health.ready is False
    assert shell.missing == {"action": 1}
    shell.close()


def test_a_module_that_has_started_stays_ready_when_another_leaves(network: Network) -> None:
    started: list[bool] = []
    module = Module("sim").on_start(lambda: started.append(True), requires={"recorder": 1})
    shell, peer = observed(network, module)
    recorder = network.join()
    recorder.announce(Member("recorder", "recorder"))
    spin_until(lambda: bool(started), shell)

    recorder.close()
    spin_until(lambda: shell.missing == {"recorder": 1}, shell)
    health = next_health(peer, shell)

    assert health.ready
    shell.close()


def test_health_has_the_notes_of_the_module(network: Network) -> None:
    module = Module("action", "action-1", notes=lambda: ["3 odometries stood still"])
    module.on(topics.ODOMETRY, command, emits=[topics.MOTOR_COMMAND])
    shell, peer = observed(network, module)

    assert next_health(peer, shell).notes == ["3 odometries stood still"]
    shell.close()
