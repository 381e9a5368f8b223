"""What a shell hands to its module, and what it counts and ignores, over either bus."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cogmap.bus.codec import Envelope, decode, encode
from cogmap.bus.interface import Incarnation
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.state.published import PublishedCounts
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock
from cogmap.schemas.topics import Delivery, Topic
from cogmap.testing import odometry
from tests.support.damage import damaged, golden
from tests.support.system.networks import (
    INCARNATION,
    Network,
    Peer,
    envelope_of,
    meet,
    publish,
    spin_until,
)

RECEIVED = [
    topic
    for topic in topics.ALL
    if topic.delivery is not Delivery.ON_REQUEST and topic is not topics.PRESENCE
]
PUBLISHED = 5
LOST = 4


class Listener:
    """A module that keeps what it receives on `topic`, in an open shell, and who publishes on it.

    `publisher` is ready: what it publishes arrives.
    """

    def __init__(self, network: Network, topic: Topic) -> None:
        self.received: list[Message] = []
        module = Module("listener").on(topic, self.received.append)
        self.shell = Shell(module, network.join(), health=False)
        self.intake = self.shell.intake
        self.shell.open()

        self.publisher = network.join()
        self.publisher.declare(topic)
        meet(self.publisher, self.shell.bus)

    @property
    def seqs(self) -> list[int]:
        """The numbers of the messages received."""
        return [message.seq for message in self.received]

    def await_received(self, count: int) -> None:
        """Spin until so many messages have been received."""
        spin_until(lambda: len(self.received) == count, self.shell)

    def await_rejected(self, topic: Topic, count: int) -> None:
        """Spin until so many messages of `topic` have been rejected."""
        spin_until(lambda: self.intake.rejected[topic.name] == count, self.shell)


@pytest.fixture
def wheels(network: Network) -> Iterator[Listener]:
    """A listener to odometry."""
    listener = Listener(network, topics.ODOMETRY)
    yield listener
    listener.shell.close()


@pytest.mark.parametrize("topic", RECEIVED, ids=lambda topic: topic.name)
def test_bad_input_is_counted_and_changes_nothing_else(network: Network, topic: Topic) -> None:
    listener = Listener(network, topic)
    whole = decode(topic, golden(topic))
    for source in (whole.source, "stranger"):
        listener.publisher.claim(Incarnation("peer", source, INCARNATION))
    envelope = encode(envelope_of(whole))
    of_another_source = encode(Envelope("stranger", whole.seq, 1, 0, 0))
    bad = [(payload, envelope) for payload in damaged(topic).values()]
    for attachment in (None, b"", b"\xc1garbage", of_another_source):
        bad.append((golden(topic), attachment))

    for count, (payload, attachment) in enumerate(bad, 1):
        network.put(topic, payload, attachment)
        listener.await_rejected(topic, count)
    assert listener.received == []

    network.put(topic, golden(topic), envelope)
    listener.await_received(1)

    assert listener.received == [whole]
    assert dict(listener.intake.rejected) == {topic.name: len(bad)}
    assert dict(listener.intake.received) == {topic.name: 1}
    assert not listener.intake.gaps
    assert listener.shell.meter.faults == 0
    listener.shell.close()


def test_bad_input_is_logged_at_most_once_a_second(
    network: Network, wheels: Listener, caplog: pytest.LogCaptureFixture
) -> None:
    envelope = encode(envelope_of(odometry(0)))
    wheels.publisher.claim(Incarnation("sim", "sim", INCARNATION))
    began_s = time.monotonic()

    with caplog.at_level(logging.WARNING, "cogmap"):
        for _ in range(200):
            network.put(topics.ODOMETRY, b"\x80", envelope)
        wheels.await_rejected(topics.ODOMETRY, 200)

    lasted_s = time.monotonic() - began_s
    logged = [record.getMessage() for record in caplog.records]
    assert "odometry" in logged[0]
    assert "speed_m_s" in logged[0]
    assert len(logged) <= 1 + lasted_s


def test_a_message_that_comes_twice_is_received_once(wheels: Listener) -> None:
    numbers = (0, 1, 1, 0, 2)

    publish(wheels.publisher, *map(odometry, numbers))
    wheels.await_received(3)

    assert wheels.seqs == [0, 1, 2]
    assert wheels.intake.received["odometry"] == 3
    assert wheels.intake.rejected["odometry"] == 2


def test_a_superseded_clock_is_never_handled(network: Network) -> None:
    listener = Listener(network, topics.CLOCK)
    peer = Peer(network.join(), topics.CLOCK)
    meet(listener.publisher, peer.bus)

    for seq in range(100):
        publish(listener.publisher, Clock(seq=seq, source="sim"))
    peer.wait_for(100)
    spin_until(lambda: 99 in listener.seqs, listener.shell)

    superseded = listener.shell.inbox.superseded["clock"]
    assert superseded + len(listener.received) == 100
    listener.shell.close()


def test_a_restarted_source_is_received_from_number_0(wheels: Listener) -> None:
    for incarnation in (1, 2):
        publish(wheels.publisher, odometry(0), odometry(1), incarnation=incarnation)
    wheels.await_received(4)

    assert not wheels.intake.rejected
    assert not wheels.intake.gaps


def test_what_is_on_its_way_when_its_source_restarts_is_received(
    network: Network, wheels: Listener
) -> None:
    publish(wheels.publisher, odometry(0), incarnation=1)
    publish(wheels.publisher, odometry(0), incarnation=2)
    network.put(topics.ODOMETRY, encode(odometry(1)), encode(envelope_of(odometry(1), 1)))
    publish(wheels.publisher, odometry(1), incarnation=2)
    wheels.await_received(4)

    assert sorted(wheels.seqs) == [0, 0, 1, 1]
    assert not wheels.intake.gaps


def publish_and_lose(network: Network, listener: Listener, path: Path) -> None:
    """A simulator, which counts in `path`, publishes and loses some messages, and ends."""
    sim = Module("sim", emits={topics.ODOMETRY})
    counts = PublishedCounts(path)
    shell = Shell(sim, network.join(), health=False, counts=counts)
    shell.open()
    meet(shell.bus, listener.shell.bus)

    received = len(listener.received)
    shell.publish(sim.stamp([odometry(0)] * PUBLISHED))
    listener.await_received(received + PUBLISHED)
    for _ in range(LOST):
        counts.add(topics.ODOMETRY)
    shell.close()


@pytest.mark.parametrize("restarts", [1, 3])
def test_what_a_publisher_lost_before_its_restart_is_counted(
    network: Network, wheels: Listener, tmp_path: Path, restarts: int
) -> None:
    path = tmp_path / "sim.published"

    for _ in range(1 + restarts):
        publish_and_lose(network, wheels, path)

    # What the last incarnation lost, only its restart would show.
    assert dict(wheels.intake.gaps) == {"odometry": restarts * LOST}
    assert not wheels.intake.rejected


def test_a_gap_in_the_numbers_of_a_source_is_counted(wheels: Listener) -> None:
    of_another_source = odometry(0, source="other")

    publish(wheels.publisher, odometry(0), odometry(4), of_another_source, odometry(5))
    wheels.await_received(4)

    assert dict(wheels.intake.gaps) == {"odometry": 3}


def test_a_loss_that_the_bus_and_the_numbers_show_counts_once(wheels: Listener) -> None:
    publish(wheels.publisher, odometry(0))
    wheels.await_received(1)
    wheels.intake.count_lost("odometry", 2)
    assert dict(wheels.intake.gaps) == {"odometry": 2}

    publish(wheels.publisher, odometry(3))
    wheels.await_received(2)

    assert dict(wheels.intake.gaps) == {"odometry": 2}
