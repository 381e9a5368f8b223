"""What a replica of the graph promises over either bus."""

from __future__ import annotations

from cogmap.graph.graph import Graph
from cogmap.graph.replica import Replica, snapshot_over
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta, Link, Phase
from cogmap.schemas.nodes import Node
from tests.support.system.networks import Network, meet, working


def delta(version: int) -> Delta:
    node = Node(id=f"building-{version}", kind="thing", activation=0.5)
    link = Link(source=node.id, target=f"place:{version}:0")
    return Delta(version=version, cycle=version, phase=Phase.OBJECTS, operations=[node, link])


def graph_at(version: int) -> Graph:
    """The graph of so many deltas."""
    graph = Graph()
    for number in range(1, version + 1):
        assert graph.apply(delta(number))
    return graph


def keeper(network: Network, graph: Graph) -> Shell:
    """The shell of a module that answers for `graph`."""
    module = Module("workspace").serve(
        topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, lambda request: graph.snapshot()
    )
    return Shell(module, network.join(), health=False)


def test_deltas_in_order_make_the_same_graph(network: Network) -> None:
    replica = Replica(snapshot_over(network.join()))

    for version in range(1, 20):
        assert replica.follow(delta(version))

    assert replica.graph.digest() == graph_at(19).digest()
    assert replica.mended == 0


def test_a_gap_is_mended_by_a_snapshot(network: Network) -> None:
    graph = graph_at(10)
    bus = network.join()
    replica = Replica(snapshot_over(bus))
    shell = keeper(network, graph)

    with working(shell):
        meet(bus, shell.bus)
        assert replica.follow(delta(1))
        assert replica.follow(delta(7))

    assert replica.mended == 1
    assert replica.graph.digest() == graph.digest()


def test_a_delta_that_the_snapshot_held_already_changes_nothing(network: Network) -> None:
    graph = graph_at(5)
    bus = network.join()
    replica = Replica(snapshot_over(bus))
    shell = keeper(network, graph)

    with working(shell):
        meet(bus, shell.bus)
        assert replica.follow(delta(3))
    assert replica.follow(delta(4))
    assert replica.follow(delta(5))

    assert replica.graph.digest() == graph.digest()


def test_without_an_answer_the_graph_stays_behind(network: Network) -> None:
    replica = Replica(snapshot_over(network.join(), timeout_s=0.5))
    assert replica.follow(delta(1))
    before = replica.graph.digest()

    assert not replica.follow(delta(3))

    assert replica.is_behind
    assert replica.graph.digest() == before
    assert replica.mended == 0
