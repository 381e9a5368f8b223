"""What one hears who listens to a system that is attacked."""

from __future__ import annotations

import time

import pytest

from benchmarks.campaign.listener import Listener
from cogmap.bus.codec import Envelope, encode
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import MotorCommand, Pose, TruePose

FORGED = 7
VIEW_NS = 200_000_000


class System:
    """A bus on which one listens."""

    def __init__(self) -> None:
        network = MemoryNetwork()
        self._bus = MemoryBus(network)
        self._bus.declare(topics.MOTOR_COMMAND)
        self._bus.declare(topics.TRUE_POSE)
        self.listener = Listener(
            MemoryBus(network), lambda envelope: envelope.incarnation == FORGED
        )

    def publish(self, message: Message, incarnation: int = 1, sent_ns: int = 0) -> None:
        envelope = Envelope("someone", 0, incarnation, sent_ns, 0)
        self._bus.publish(topics.of(message), encode(message), envelope)
        self.listener.pump(0.0)

    def command(self, stamp_ns: int, speed_rad_s: float = 1.0, incarnation: int = 1) -> None:
        self.publish(
            MotorCommand(
                stamp_ns=stamp_ns, left_wheel_rad_s=speed_rad_s, right_wheel_rad_s=speed_rad_s
            ),
            incarnation,
        )


@pytest.fixture
def system() -> System:
    system = System()
    pose = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
    system.publish(TruePose(stamp_ns=VIEW_NS, pose=pose, travelled_m=0.0, progress=0.0))
    return system


def test_a_command_is_of_when_it_was_sent_however_late_it_is_heard(system: System) -> None:
    late_s = 3.0
    answer = MotorCommand(stamp_ns=VIEW_NS, left_wheel_rad_s=1.0, right_wheel_rad_s=1.0)
    sent_s = time.monotonic() - late_s
    system.publish(answer, sent_ns=time.time_ns() - round(late_s * 1e9))

    (command,) = system.listener.commands
    assert command.time_s == pytest.approx(sent_s, abs=1.0)


def test_only_commands_that_answer_a_later_view_are_progress(system: System) -> None:
    system.command(VIEW_NS)
    system.command(VIEW_NS)
    system.command(2**60)
    system.command(VIEW_NS + 1, speed_rad_s=0.0)

    assert [command.moves for command in system.listener.commands] == [True, False]


def test_what_is_forged_is_neither_progress_nor_the_newest_message(system: System) -> None:
    system.command(VIEW_NS, incarnation=FORGED)

    assert not system.listener.commands
    assert topics.MOTOR_COMMAND not in system.listener.newest


def test_another_incarnation_of_a_trusted_source_is_not_its_own(system: System) -> None:
    system.listener.trusted = dict(system.listener.incarnations)
    system.command(VIEW_NS, incarnation=2)

    assert not system.listener.commands
