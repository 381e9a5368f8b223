"""What the Zenoh bus promises when the router dies and comes back."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import msgspec
import pytest

from cogmap.bus.interface import CACHED_MESSAGES
from cogmap.bus.session import free_endpoint
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from schemas import topics
from schemas.graph import Delta, Phase
from schemas.nodes import Node
from schemas.sensing import Odometry
from tests.support.networks import OverZenoh, Peer, meet, publish, spin_until, working


class Router:
    """A router in a process of its own, to be killed."""

    def __init__(self) -> None:
        self.endpoint = free_endpoint()
        self.start()

    def start(self) -> None:
        command = [sys.executable, "-m", "cli.main", "router", "--tied", "--connect", self.endpoint]
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


def odometry(seq: int) -> Odometry:
    return Odometry(
        speed_m_s=1.0, turn_rate_rad_s=0.0, dt_s=0.05, seq=seq, source="sim", stamp_ns=seq
    )


@pytest.mark.parametrize("afterwards", [0, 20], ids=["nothing said since", "more said since"])
def test_what_is_published_while_the_router_is_dead_arrives_afterwards(
    router: Router, afterwards: int
) -> None:
    network = OverZenoh(router.endpoint)
    publisher, *subscribers = (network.join() for _ in range(3))
    publisher.declare(topics.ODOMETRY)
    peers = [Peer(subscriber, topics.ODOMETRY) for subscriber in subscribers]
    meet(publisher, *subscribers)

    publish(publisher, *(odometry(seq) for seq in range(20)))
    for peer in peers:
        peer.wait_for(20)
    router.kill()
    publish(publisher, *(odometry(seq) for seq in range(20, 40)))
    router.start()
    publish(publisher, *(odometry(seq) for seq in range(40, 40 + afterwards)))

    for peer in peers:
        assert peer.take_seqs(40 + afterwards) == list(range(40 + afterwards))
    network.close()


def test_a_loss_beyond_the_cache_is_counted_and_a_snapshot_mends_the_graph(
    router: Router,
) -> None:
    graph = Graph()
    network = OverZenoh(router.endpoint)
    lost = 50
    keeper = Module("workspace").serve(
        topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, lambda request: graph.snapshot()
    )
    publisher = network.join()
    reader = network.join()
    publisher.declare(topics.DELTA)
    replica = Graph()
    follower = Shell(Module("follower").following(replica), reader, health=False)
    follower.open()

    def commit() -> None:
        node = Node(id=f"building-{graph.version}", kind="thing", activation=0.5)
        delta = Delta(version=graph.version + 1, cycle=1, phase=Phase.OBJECTS, operations=[node])
        graph.apply(delta)
        numbered = msgspec.structs.replace(delta, source="workspace", seq=delta.version)
        publish(publisher, numbered)

    with working(Shell(keeper, network.join(), health=False)):
        meet(publisher, reader)
        commit()
        spin_until(lambda: replica.version == 1, follower)
        router.kill()
        for _ in range(CACHED_MESSAGES + lost):
            commit()
        router.start()
        spin_until(lambda: replica.version == graph.version, follower)

    assert replica.digest() == graph.digest()
    assert follower.notes == ["snapshots that replaced the graph after a gap: 1"]
    assert dict(follower.intake.gaps) == {topics.DELTA.name: lost}
    follower.close()
