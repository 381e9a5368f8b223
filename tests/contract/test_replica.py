"""What a replica of the graph promises over either bus."""

from __future__ import annotations

from msgspec.structs import replace

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


def stated(graph: Graph, version: int, seq: int, name: str = "") -> Delta:
    """The delta of a version as the workspace of `graph` publishes it at the end of a cycle."""
    node = Node(id=name or f"building-{version}", kind="thing", activation=0.5)
    return Delta(
        source="workspace",
        seq=seq,
        version=version,
        cycle=version,
        phase=Phase.END,
        operations=[node],
        lineage=graph.lineage or "",
    )


def follow_all(network: Network, graph: Graph, *deltas: Delta) -> Replica:
    """A replica that has followed all of them, while a workspace answers for `graph`."""
    bus = network.join()
    replica = Replica(snapshot_over(bus))
    shell = keeper(network, graph)
    with working(shell):
        meet(bus, shell.bus)
        for each in deltas:
            replica.follow(each)
    return replica


def committed(number: int) -> tuple[Graph, list[Delta]]:
    """A graph, and the deltas that made it."""
    graph = Graph()
    deltas = []
    for version in range(1, number + 1):
        each = stated(graph, version, version - 1)
        deltas.append(each)
        assert graph.apply(each)
    return graph, deltas


def test_a_delta_in_the_place_of_the_workspaces_is_found_as_that_one_comes(
    network: Network,
) -> None:
    graph, deltas = committed(3)
    forged = stated(Graph(), 3, 99, "nothing of the kind")
    forged = replace(forged, lineage=deltas[2].lineage)

    replica = follow_all(network, graph, *deltas[:2], forged, deltas[2])
    assert replica.forks == replica.mended == 1
    assert replica.graph.digest() == graph.digest()


def test_a_delta_that_took_the_number_of_the_workspaces_is_found_at_the_end_of_the_cycle(
    network: Network,
) -> None:
    graph, deltas = committed(4)
    forged = replace(deltas[2], operations=[])

    replica = follow_all(network, graph, *deltas[:2], forged, deltas[3])
    assert replica.forks == replica.mended == 1
    assert replica.graph.digest() == graph.digest()


def test_a_version_that_the_workspace_has_not_is_asked_for_once(network: Network) -> None:
    graph, deltas = committed(3)
    forged = replace(deltas[2], seq=99, version=2**30)

    replica = follow_all(network, graph, *deltas[:2], forged)
    assert replica.untrue == 1
    assert not replica.is_behind
    assert replica.graph.version == 3


def test_a_replica_that_joins_follows_on_from_the_snapshots_lineage(network: Network) -> None:
    graph, deltas = committed(3)
    next_delta = stated(graph, 4, 3)
    graph.apply(next_delta)
    bus = network.join()
    shell = keeper(network, graph)
    replica = Replica(snapshot_over(bus))
    with working(shell):
        meet(bus, shell.bus)
        replica.join()
        for version in range(5, 8):
            each = stated(graph, version, version - 1)
            graph.apply(each)
            assert replica.follow(each)

    assert replica.forks == replica.mended == 0
    assert replica.graph.lineage == graph.lineage
    assert deltas[0].lineage != graph.lineage


def test_a_delta_of_another_source_changes_nothing(network: Network) -> None:
    graph, deltas = committed(3)
    strange = replace(deltas[2], source="stranger")

    replica = follow_all(network, graph, *deltas[:2], strange)
    assert replica.graph.version == 2
    assert replica.mended == 0


def test_a_log_without_lineages_is_followed_as_before(network: Network) -> None:
    graph = graph_at(4)
    replica = Replica(snapshot_over(network.join()))
    for version in range(1, 5):
        assert replica.follow(delta(version))

    assert replica.forks == 0
    assert replica.graph.lineage == graph.lineage
