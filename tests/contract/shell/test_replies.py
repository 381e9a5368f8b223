"""What a shell publishes and answers for its module, over either bus."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from cogmap.bus.codec import decode, encode
from cogmap.errors import MessageError, NoAnswerError
from cogmap.runtime.module import Module, Reply
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.graph import Decay, Snapshot, SnapshotRequest
from cogmap.schemas.sensing import MotorCommand, Odometry
from cogmap.testing import odometry
from tests.support.system.networks import (
    TIMEOUT_S,
    Network,
    Peer,
    meet,
    publish,
    spin_until,
    working,
)

Handler = Callable[[Odometry], Reply]
EMPTY = Snapshot(version=0, cycle=0, decay=Decay(), nodes=[], links=[], tiles=[])


def command(odometry: Odometry) -> MotorCommand:
    return MotorCommand(left_wheel_rad_s=1.0, right_wheel_rad_s=1.0, stamp_ns=odometry.stamp_ns)


class Acting:
    """A module that answers odometry with commands, in an open shell, and a peer beside it."""

    def __init__(self, network: Network, handler: Handler) -> None:
        module = Module("action").on(topics.ODOMETRY, handler, emits=[topics.MOTOR_COMMAND])
        self.shell = Shell(module, network.join(), health=False)
        self.peer = Peer(network.join(), topics.MOTOR_COMMAND)
        self.peer.bus.declare(topics.ODOMETRY)
        self.shell.open()
        meet(self.peer.bus, self.shell.bus)

    def move(self, count: int) -> None:
        """Publish odometry with the numbers and stamps 0, 1, and so on."""
        for seq in range(count):
            publish(self.peer.bus, odometry(seq, stamp_ns=seq))

    def await_commands(self, count: int) -> None:
        spin_until(lambda: self.peer.arrived == count, self.shell)


@pytest.mark.parametrize(
    "error", [MessageError("image of the wrong shape"), ZeroDivisionError("division by zero")]
)
def test_a_module_whose_handler_raises_continues(network: Network, error: Exception) -> None:
    def handle(message: Odometry) -> MotorCommand:
        if message.seq == 1:
            raise error
        return command(message)

    acting = Acting(network, handle)
    acting.move(3)
    acting.await_commands(2)

    payloads = [arrival.payload for arrival in acting.peer.take(2)]
    first, second = (decode(topics.MOTOR_COMMAND, payload) for payload in payloads)
    assert (first.stamp_ns, first.seq, first.source) == (0, 0, "action")
    assert (second.stamp_ns, second.seq, second.source) == (2, 1, "action")
    assert acting.shell.intake.rejected["odometry"] == 1
    assert acting.shell.meter.faults == (0 if isinstance(error, MessageError) else 1)
    acting.shell.close()


def test_the_causes_and_the_latency_of_a_message_travel_with_it(network: Network) -> None:
    def handle_odd(message: Odometry) -> MotorCommand | None:
        return command(message) if message.seq % 2 else None

    acting = Acting(network, handle_odd)
    acting.move(4)
    acting.await_commands(2)

    for arrival, numbers in zip(acting.peer.take(2), ([0, 1], [2, 3]), strict=True):
        envelope = arrival.envelope
        assert envelope is not None
        assert envelope.causes == [("odometry", "sim", seq) for seq in numbers]
        ((name, compute_ns, rest_ns),) = envelope.stages
        assert name == "action"
        assert compute_ns + rest_ns == envelope.sent_ns - envelope.born_ns
    acting.shell.close()


def test_a_message_is_published_before_the_next_one_is_computed(network: Network) -> None:
    published: list[int] = []

    def handle_in_steps(message: Odometry) -> Iterator[MotorCommand]:
        yield command(message)
        published.append(acting.shell.publisher.emitted["motor/command"])
        yield command(message)

    acting = Acting(network, handle_in_steps)
    acting.move(1)
    acting.await_commands(2)

    assert published == [1]
    first, second = acting.peer.take(2)
    assert first.envelope is not None
    assert second.envelope is not None
    assert first.envelope.causes == [("odometry", "sim", 0)]
    assert second.envelope.causes == []
    acting.shell.close()


def test_what_was_published_before_a_handler_raised_stays(network: Network) -> None:
    def handle_in_steps(message: Odometry) -> Iterator[MotorCommand]:
        yield command(message)
        if message.seq == 0:
            raise ZeroDivisionError("division by zero")

    acting = Acting(network, handle_in_steps)
    acting.move(2)
    acting.await_commands(2)

    causes = []
    for arrival in acting.peer.take(2):
        assert arrival.envelope is not None
        causes += arrival.envelope.causes
    assert causes == [("odometry", "sim", 0), ("odometry", "sim", 1)]
    assert acting.shell.meter.faults == 1
    acting.shell.close()


@pytest.fixture
def workspace(network: Network) -> Iterator[Shell]:
    """A running shell whose module answers every request with an empty snapshot."""
    module = Module("workspace").serve(
        topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, lambda request: EMPTY
    )
    shell = Shell(module, network.join(), health=False)
    with working(shell):
        yield shell


def test_a_query_without_sense_is_refused_and_counted(network: Network, workspace: Shell) -> None:
    asker = network.join()
    proper = encode(SnapshotRequest())
    negative_stamp = proper.replace(b"\x00", b"\xff", 1)
    meet(asker, workspace.bus)

    with pytest.raises(NoAnswerError, match="stamp_ns"):
        asker.query(topics.SNAPSHOT_REQUEST, negative_stamp, TIMEOUT_S)
    answer = asker.query(topics.SNAPSHOT_REQUEST, proper, TIMEOUT_S)

    assert decode(topics.SNAPSHOT, answer.payload) == EMPTY
    assert workspace.intake.rejected == {"workspace/snapshot_request": 1}
