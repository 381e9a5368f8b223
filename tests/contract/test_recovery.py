"""What the Zenoh bus promises when the router dies and comes back."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import pytest

from cogmap.bus.depth import cached_messages
from cogmap.bus.interface import Bus
from cogmap.bus.session import free_endpoint
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.nodes import Node
from cogmap.testing import odometry
from tests.support.system.networks import OverZenoh, Peer, meet, publish, spin_until, working


class Router:
    """A router in a process of its own, to be killed."""

    def __init__(self) -> None:
        self.endpoint = free_endpoint()
        self.start()

    def start(self) -> None:
        command = [
            sys.executable,
            "-m",
            "cogmap.cli.main",
            "router",
            "--tied",
            "--connect",
            self.endpoint,
        ]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert self._process.stderr is not None
        assert "router listens" in self._process.stderr.readline()

    def kill(self) -> None:
        with self._process as process:
            process.kill()


@pytest.fixture
def router() -> Iterator[Router]:
    router = Router()
    yield router
    router.kill()


def publish_odometry(bus: Bus, numbers: range) -> None:
    publish(bus, *map(odometry, numbers))


@pytest.mark.parametrize("afterwards", [0, 20], ids=["nothing since", "more since"])
def test_what_is_published_while_the_router_is_dead_arrives_afterwards(
    router: Router, afterwards: int
) -> None:
    network = OverZenoh(router.endpoint)
    publisher = network.join()
    publisher.declare(topics.ODOMETRY)
    peers = [Peer(network.join(), topics.ODOMETRY) for _ in range(2)]
    meet(publisher, *(peer.bus for peer in peers))
    publish_odometry(publisher, range(20))
    for peer in peers:
        peer.wait_for(20)

    router.kill()
    publish_odometry(publisher, range(20, 40))
    router.start()
    count = 40 + afterwards
    publish_odometry(publisher, range(40, count))

    for peer in peers:
        assert peer.take_seqs(count) == list(range(count))
    network.close()


class Keeper:
    """Answers for a graph, and publishes what changes in it."""

    def __init__(self, network: OverZenoh) -> None:
        self.graph = Graph()
        module = Module("workspace").serve(
            topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, lambda request: self.graph.snapshot()
        )
        self.shell = Shell(module, network.join(), health=False)
        self.shell.bus.declare(topics.DELTA)

    def commit(self, number: int) -> None:
        """Add so many nodes, each in a delta of its own."""
        for _ in range(number):
            version = self.graph.version + 1
            node = Node(id=f"building-{version}", kind="thing", activation=0.5)
            delta = Delta(
                version=version,
                cycle=1,
                phase=Phase.OBJECTS,
                operations=[node],
                source="workspace",
                seq=version,
            )
            self.graph.apply(delta)
            publish(self.shell.bus, delta, incarnation=self.shell.publisher.incarnation)


def test_a_loss_beyond_the_cache_is_counted_and_a_snapshot_mends_the_graph(
    router: Router,
) -> None:
    lost = 50
    network = OverZenoh(router.endpoint)
    keeper = Keeper(network)
    replica = Graph()
    follower = Shell(Module("follower").following(replica), network.join(), health=False)
    follower.open()

    with working(keeper.shell):
        meet(keeper.shell.bus, follower.bus)
        keeper.commit(1)
        spin_until(lambda: replica.version == 1, follower)

        router.kill()
        keeper.commit(cached_messages(topics.DELTA) + lost)
        router.start()
        spin_until(lambda: replica.version == keeper.graph.version, follower)

    assert replica.digest() == keeper.graph.digest()
    assert follower.notes == ["snapshots that replaced the graph after a gap: 1"]
    assert dict(follower.intake.gaps) == {topics.DELTA.name: lost}
    follower.close()
    network.close()
