"""A shell fetches the messages that the bus lost from those who published them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from cogmap.bus.codec import Envelope, encode
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.state.outbox import Outbox
from cogmap.runtime.state.published import PublishedCounts
from cogmap.schemas import topics
from cogmap.schemas.sensing import Odometry
from cogmap.testing import odometry
from tests.support.system.networks import Network, meet, spin_until


class Source:
    """A simulator that keeps on disk what it publishes, and can lose messages on their way."""

    def __init__(self, network: Network, folder: Path) -> None:
        self._module = Module("sim", emits={topics.ODOMETRY})
        self._counts = PublishedCounts(folder / "sim.published")
        self._outbox = Outbox(folder / "sim.outbox")
        self.shell = Shell(
            self._module,
            network.join(),
            health=False,
            counts=self._counts,
            outbox=self._outbox,
        )
        self.shell.open()

    def publish(self, number: int) -> None:
        """Publish so many messages."""
        self.shell.publish(self._module.stamp([odometry(0)] * number))

    def lose(self, number: int, *, keeps: bool = True) -> None:
        """Publish so many messages that reach nobody."""
        for message in self._module.stamp([odometry(0)] * number):
            earlier = self._counts.earlier(topics.ODOMETRY)
            self._counts.add(topics.ODOMETRY)
            incarnation = self.shell.publisher.incarnation
            envelope = Envelope("sim", message.seq, incarnation, 0, 0, earlier=earlier)
            if keeps:
                kept = encode(envelope), encode(message)
                self._outbox.append(topics.ODOMETRY, earlier + message.seq, *kept)


class Listener:
    """A module that keeps what it receives, in an open shell."""

    def __init__(self, network: Network) -> None:
        self.received: list[Odometry] = []
        module = Module("listener").on(topics.ODOMETRY, self.received.append)
        self.shell = Shell(module, network.join(), health=False)
        self.shell.open()

    @property
    def seqs(self) -> list[int]:
        return [message.seq for message in self.received]

    def await_received(self, count: int) -> None:
        spin_until(lambda: len(self.received) >= count, self.shell)


@pytest.fixture
def listener(network: Network) -> Iterator[Listener]:
    listener = Listener(network)
    yield listener
    listener.shell.close()


def started(network: Network, listener: Listener, folder: Path) -> Source:
    """A source that the listener receives from."""
    source = Source(network, folder)
    meet(source.shell.bus, listener.shell.bus)
    return source


def test_lost_messages_are_fetched_in_order_before_the_next(
    network: Network, listener: Listener, tmp_path: Path
) -> None:
    source = started(network, listener, tmp_path)
    source.publish(3)
    source.lose(50)
    source.publish(2)

    listener.await_received(55)

    assert listener.seqs == list(range(55))
    assert not listener.shell.intake.gaps
    assert not listener.shell.intake.rejected
    source.shell.close()


def test_lost_messages_that_nobody_has_kept_are_counted(
    network: Network, listener: Listener, tmp_path: Path
) -> None:
    source = started(network, listener, tmp_path)
    source.publish(3)
    source.lose(4, keeps=False)
    source.lose(5)
    source.publish(1)

    listener.await_received(9)

    assert listener.seqs == [0, 1, 2, 7, 8, 9, 10, 11, 12]
    assert dict(listener.shell.intake.gaps) == {"odometry": 4}
    source.shell.close()


def test_a_restarted_source_gives_what_its_last_incarnations_lost(
    network: Network, listener: Listener, tmp_path: Path
) -> None:
    first = started(network, listener, tmp_path)
    first.publish(3)
    listener.await_received(3)
    first.lose(4)
    first.shell.close()
    unseen = Source(network, tmp_path)
    unseen.lose(2)
    unseen.shell.close()

    last = started(network, listener, tmp_path)
    last.publish(1)
    listener.await_received(10)

    assert listener.seqs == [0, 1, 2, 3, 4, 5, 6, 0, 1, 0]
    assert not listener.shell.intake.gaps
    last.shell.close()


def test_a_late_listener_asks_for_nothing_of_the_past(network: Network, tmp_path: Path) -> None:
    source = Source(network, tmp_path)
    source.publish(5)
    late = Listener(network)
    meet(source.shell.bus, late.shell.bus)

    source.publish(1)
    late.await_received(1)

    assert late.seqs == [5]
    late.shell.close()
    source.shell.close()
